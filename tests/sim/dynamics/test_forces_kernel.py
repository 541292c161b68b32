"""Forces of one tick, returned to an external simulator, equal those of the batch."""

import math

import numpy as np
import pytest
import torch

from drone_rl.sim.dynamics import Mode
from drone_rl.sim.dynamics import state as fs
from drone_rl.sim.dynamics.forces_kernel import forces
from tests.flying import (
    ANGLES,
    GRAVITY,
    POSITIONS,
    VELOCITIES,
    doubles,
    falling,
    hovering,
    matrix,
    quadrotor,
)
from tests.flying import make_goals as goals_of

ROTORS = (Mode.ROTOR,) * 4


def test_hovering_drone_is_supported():
    drone = quadrotor()
    state = hovering(drone)
    after, pushes = forces(drone.frame, state, goals_of(POSITIONS, 0, 0, 0, 100.0), 0)
    np.testing.assert_allclose(pushes[0], (0, 0, GRAVITY, 0, 0, 0), atol=1e-5)
    assert after.ticks.tolist() == [1] and torch.equal(after.position, state.position)


def test_torques_and_thrust_turn_with_the_body():
    """Rolled right by 90 degrees: thrust to the right, yaw torque about the world's -y."""
    drone = quadrotor(rotor_time_constant=0.0)
    state = falling()
    root = math.sqrt(0.5)
    state.attitude[:] = doubles((root, root, 0.0, 0.0))
    _, pushes = forces(drone.frame, state, goals_of(ROTORS, 0.1, 0.1, 0.3, 0.3), 0)
    np.testing.assert_allclose(pushes[0, :3], (0, -0.8 * 4.179446268, 0), atol=1e-5)
    np.testing.assert_allclose(pushes[0, 3:], (0, -0.4 * 0.055562, 0), atol=1e-6)


@pytest.mark.parametrize("tick", [0, 7])
def test_forces_equal_the_acceleration_of_one_tick(tick):
    """Compare with velocity changes of the batch, in random attitudes and gusts."""
    count, source = 20, np.random.default_rng(3)
    drone = quadrotor(wind=(3.0, 0.0, 0.0), gusts=1.0)
    state = hovering(drone, count=count, seeds=torch.arange(count))
    state.attitude[:] = torch.tensor(source.normal(size=(count, 4)))
    state.attitude[:] /= state.attitude.norm(dim=-1, keepdim=True)
    state.velocity[:] = torch.tensor(source.normal(size=(count, 3)) * 5)
    state.angular_velocity[:] = torch.tensor(source.normal(size=(count, 3)))
    for modes, drift in ((POSITIONS, (0.2, -0.1)), (VELOCITIES, (0, 0)), (ANGLES, (0, 0))):
        drift = (*drift, 0.1 * (modes != VELOCITIES), 0.0)
        goals = goals_of(modes, 0.5, -0.4, 0.3, 100.5, count=count, drift=drift)
        state.numbers[:, fs.TICKS] = tick
        after, pushes = forces(drone.frame, state, goals, tick)
        since = goals.values + tick * 0.003 * goals.drifts  # the batch starts at its first tick
        if modes == VELOCITIES:
            since = goals.values
        flown = drone.fly(state, type(goals)(modes, since, goals.drift), 1)
        gained = (flown.velocity - state.velocity) / 0.003 + torch.tensor([0, 0, GRAVITY])
        np.testing.assert_allclose(gained, pushes[:, :3], atol=2e-3)
        for world in range(count):
            inertia = np.array(drone.settings.inertia)
            rates = state.angular_velocity[world].numpy()
            torque = matrix(state.attitude[world]).T @ pushes[world, 3:].numpy()
            spin = (torque - np.cross(rates, inertia * rates)) / inertia * 0.003
            np.testing.assert_allclose(flown.angular_velocity[world], rates + spin, atol=1e-5)
        torch.testing.assert_close(after.rotors, flown.rotors, atol=1e-6, rtol=0)
        torch.testing.assert_close(after.gust, flown.gust, atol=1e-6, rtol=0)
        assert torch.equal(after.ticks, flown.ticks)


def test_lost_drone_has_no_forces():
    drone = quadrotor()
    state = hovering(drone, count=2)
    state.velocity[0] = float("nan")
    after, pushes = forces(drone.frame, state, goals_of(POSITIONS, 0, 0, 0, 100.0, count=2), 0)
    assert after.is_lost.tolist() == [True, False]
    assert not pushes[0].any() and pushes[1, 2] > 9


def test_reference_after_a_command():
    state = hovering(quadrotor())
    state.attitude[:] = doubles((math.cos(0.2), 0.0, 0.0, math.sin(0.2)))
    goals = goals_of(POSITIONS, 1.0, 2.0, 0.5, 101.0, drift=(0.1, 0.2, 0.3, 0.4))
    np.testing.assert_allclose(goals.reference_after(2.0, state)[0], (1.2, 2.4, 1.1, 101.8))
    free = goals_of(VELOCITIES, 1.0, 2.0, 0.5, 1.0)
    np.testing.assert_allclose(free.reference_after(2.0, state)[0], (0, 0, 0.4, 100), atol=1e-9)
