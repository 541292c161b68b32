"""What the whole cascade asks of rotors that answer at once; and how each of its levels answers."""

import math

import numpy as np
import pytest
import torch

from drone_rl.sim.dynamics import Mode
from tests.flying import (
    ANGLES,
    POSITIONS,
    VELOCITIES,
    StepResponse,
    angles,
    doubles,
    hovering,
    make_goals,
    quadrotor,
    trajectory,
)

RATES = (Mode.RATE, Mode.RATE, Mode.RATE, Mode.POSITION)
BARE = (Mode.RATE, Mode.RATE, Mode.RATE, Mode.THROTTLE)
HEADS = (Mode.HEADING_VELOCITY, Mode.HEADING_VELOCITY, Mode.RATE, Mode.VELOCITY)


def asked(modes, *values, yaw=0.0, drift=None, change=None):
    """What a drone that hovers at (0, 0, 100) asks of each rotor in the first tick."""
    drone = quadrotor(rotor_time_constant=0.0)
    state = hovering(drone)
    state.attitude[:] = doubles((math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)))
    for name, value in (change or {}).items():
        getattr(state, name)[:] = doubles(value)
    return drone.fly(state, make_goals(modes, *values, drift=drift), 1).rotors[0].numpy()


def control(rotors):
    """Throttle, and the share of control about each axis."""
    rows = np.array([[1, 1, 1, 1], [-1, 1, 1, -1], [-1, 1, -1, 1], [-1, -1, 1, 1]])
    return rows @ rotors / 4


HOVER = 9.81 / (4 * 4.179446268)


def test_rates_are_told_and_limited():
    """A quarter of the control for each radian a second."""
    np.testing.assert_allclose(
        control(asked(BARE, 0.2, 0.4, 0.6, 0.5)), (0.5, 0.05, 0.1, 0.15), atol=1e-6
    )
    spinning = asked(BARE, 0.2, 0.4, 0.6, 0.5, change={"angular_velocity": (0.2, 0.4, 0.2)})
    np.testing.assert_allclose(control(spinning), (0.5, 0.0, 0.0, 0.1), atol=1e-6)
    np.testing.assert_allclose(
        control(asked(BARE, 90.0, 0.0, 0.0, 0.5))[1] / control(asked(BARE, 2.5, 0, 0, 0.5))[1], 1.0
    )
    assert control(asked(BARE, 0.0, 0.0, -90.0, 0.2))[3] < 0


def test_angles_are_told():
    """0.1 rad asks for 0.625 of 2.5 rad/s, and so for 0.15625 of the control."""
    found = control(asked((*ANGLES[:3], Mode.THROTTLE), 0.1, -0.1, 0.05, 0.5))
    np.testing.assert_allclose(found, (0.5, 0.15625, -0.15625, 0.078125), atol=1e-6)


def test_a_heading_is_sought_by_the_shorter_way():
    modes = (*ANGLES[:3], Mode.THROTTLE)
    assert control(asked(modes, 0, 0, -3.0, 0.5, yaw=3.0))[3] > 0.1
    assert control(asked(modes, 0, 0, 3.0, 0.5, yaw=-3.0))[3] < -0.1
    np.testing.assert_allclose(control(asked(modes, 0, 0, 3.0, 0.5, yaw=3.0))[3], 0, atol=1e-6)


def test_a_heading_that_drifts_is_followed_at_its_rate():
    modes = (*ANGLES[:3], Mode.THROTTLE)
    found = control(asked(modes, 0, 0, 0.0, 0.5, drift=(0, 0, 0.4, 0)))
    np.testing.assert_allclose(found[3], 0.1, atol=1e-6)


SHARE = 0.2 * math.pi / 5.5 * 2.5 * 2.5 * 0.25
"""Of control for a metre a second: gain times angle, times rates, times control."""


@pytest.mark.parametrize("yaw", [0.0, 1.0, -2.5, math.pi])
def test_velocities_are_of_the_world_or_of_the_heading(yaw):
    x, y, c, s = 0.3, -0.2, math.cos(yaw), math.sin(yaw)
    world = control(asked(VELOCITIES, x, y, 0.0, 0.0, yaw=yaw))
    forward, left = c * x + s * y, c * y - s * x
    np.testing.assert_allclose(world, (HOVER, -SHARE * left, SHARE * forward, 0), atol=1e-6)
    same = control(asked(HEADS, forward, left, 0.0, 0.0, yaw=yaw))
    np.testing.assert_allclose(same, world, atol=1e-6)
    moving = {"velocity": (x, y, 0.0)}
    for modes, goal in ((VELOCITIES, (x, y)), (HEADS, (forward, left))):
        at_it = control(asked(modes, *goal, 0.0, 0.0, yaw=yaw, change=moving))
        np.testing.assert_allclose(at_it, (HOVER, 0, 0, 0), atol=1e-6)


def test_places_are_led_to_by_velocities():
    """Half a metre ahead asks for 0.75 m/s; a metre up for 1 m/s, which is all thrust there is."""
    found = control(asked(POSITIONS, 0.5, -0.5, 0.0, 100.0))
    np.testing.assert_allclose(found, (HOVER, 0.75 * SHARE, 0.75 * SHARE, 0), atol=1e-6)
    found = control(asked(POSITIONS, 0.0, 0.0, 0.0, 100.1))
    np.testing.assert_allclose(found[0], HOVER + 0.5 * 2.0 * 0.1, atol=1e-6)
    assert control(asked(POSITIONS, 0.0, 0.0, 0.0, 101.0))[0] == pytest.approx(1.0)


def test_a_place_that_drifts_is_followed_at_its_speed():
    found = control(asked(POSITIONS, 0.0, 0.0, 0.0, 100.0, drift=(0.3, -0.2, 0.0, 0.05)))
    np.testing.assert_allclose(found, (HOVER + 0.05, 0.2 * SHARE, 0.3 * SHARE, 0), atol=1e-6)
    far = control(asked(POSITIONS, 50.0, 0.0, 0.0, 100.0, drift=(50.0, 0.0, 0.0, 0.0)))
    moving = {"velocity": (6.0, 0.0, 0.0)}
    fast = control(asked(POSITIONS, 50.0, 0, 0, 100.0, drift=(50.0, 0, 0, 0), change=moving))
    assert far[2] > 0.1 and fast[2] == pytest.approx(0.0, abs=1e-6)  # 6 m/s is the most


def test_rotors_are_told_without_a_controller():
    every = (Mode.ROTOR,) * 4
    np.testing.assert_allclose(asked(every, 0.1, 0.2, 0.3, 0.4), (0.1, 0.2, 0.3, 0.4), atol=1e-7)


STEPS = {  # modes, goal, axis, what, rise, overshoot, settled
    "rate": (RATES, (0, 0, 1.0, 100.0), 2, "rates", 0.6, 0.01),
    "angle": (ANGLES, (0.3, 0, 0, 100.0), 0, "angles", 0.6, 0.02),
    "velocity": (VELOCITIES, (2.0, 0, 0, 0), 0, "speed", 3.0, 0.05),
    "climb": (VELOCITIES, (0, 0, 0, 1.0), 2, "speed", 1.0, 0.2),
    "position": (POSITIONS, (2.0, 0, 0, 100.0), 0, "place", 3.5, 0.33),
    "height": (POSITIONS, (0, 0, 0, 101.0), 2, "place", 3.5, 0.1),
}


@pytest.mark.parametrize("name", STEPS)
def test_a_step_is_answered(name):
    modes, goal, axis, what, rise, overshoot = STEPS[name]
    drone = quadrotor()
    states = trajectory(drone, hovering(drone), make_goals(modes, *goal), 3300, 3)
    read = {
        "rates": lambda s: s.angular_velocity,
        "angles": angles,
        "speed": lambda s: s.velocity,
        "place": lambda s: s.position,
    }[what]
    values = torch.cat([read(s) for s in states]).numpy()[:, axis]
    start = 100.0 if name == "height" else 0.0
    wanted = 1.0 if name in ("rate", "climb", "height") else max(goal[:3])
    response = StepResponse(values - start, wanted, tick=0.009)
    assert 0.0 < response.rise < rise
    assert response.overshoot < overshoot
    assert response.settling_time(0.05) < 2.0 * rise


def test_no_limit_is_exceeded_whatever_is_wanted():
    """Sixty drones between random places: what they do stays near what controllers may ask for."""
    drone, source = quadrotor(), np.random.default_rng(0)
    state = hovering(drone, count=60)
    most = np.zeros(4)
    for _ in range(10):
        values = torch.tensor(source.uniform(-20, 20, (60, 4)))
        values[:, 2] /= 7
        values[:, 3] += 100
        goals = make_goals(POSITIONS, 0, 0, 0, 0, count=60)
        goals.values[:] = values
        for _ in range(10):
            state = drone.fly(state, goals, 33)
            tilt = angles(state)[:, :2].abs().max()
            speed = state.velocity.abs()
            spin = state.angular_velocity.abs().max()
            now = [speed[:, :2].max(), speed[:, 2].max(), tilt, spin]
            most = np.maximum(most, [float(v) for v in now])
            assert float(state.rotors.min()) >= 0.0 and float(state.rotors.max()) <= 1.0
    assert not state.is_lost.any()
    assert most[0] < 6.0 * 1.2 and most[1] < 4.0 * 1.6
    assert most[2] < math.pi / 5.5 * 1.3 and most[3] < 2.5 * 2**0.5 * 1.1
