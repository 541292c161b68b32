"""Comparison with the reference drone in double precision, and the end of a tick."""

import math

import numpy as np
import pytest

from drone_rl.sim.dynamics import Mode, Obstacles
from drone_rl.sim.dynamics.control import rotor_goals
from tests.flying import (
    ANGLES,
    POSITIONS,
    VELOCITIES,
    ReferenceDrone,
    degrees_between,
    doubles,
    falling,
    hovering,
    make_goals,
    matrix,
    quadrotor,
    trajectory,
)

HEADS = (Mode.HEADING_VELOCITY, Mode.HEADING_VELOCITY, Mode.RATE, Mode.POSITION)
TICKS = 3333
FLIGHTS = {
    "hover": (POSITIONS, (0.0, 0.0, 0.0, 100.0), {}),
    "hover in wind": (POSITIONS, (0.0, 0.0, 0.0, 100.0), {"wind": (5.0, 2.0, -1.0)}),
    "step": (POSITIONS, (3.0, -2.0, 1.0, 102.0), {}),
    "roll": (ANGLES, (0.7, -0.4, 2.0, 101.0), {}),
    "speeds": (VELOCITIES, (4.0, -2.0, 0.7, 1.0), {"wind": (4.0, -3.0, 1.0)}),
    "circle": (HEADS, (3.0, 1.0, 0.5, 101.0), {}),
    "slow rotors": (POSITIONS, (1.0, 1.0, -2.0, 99.0), {"rotor_time_constant": 0.03}),
}


@pytest.mark.parametrize("name", FLIGHTS)
def test_single_precision_error_is_below_1_mm_in_10_s(name):
    """The angular error without contacts is below 0.01 degrees; commands have 33 ticks."""
    modes, goal, changes = FLIGHTS[name]
    drone = quadrotor(**changes)
    after = trajectory(drone, hovering(drone), make_goals(modes, *goal), TICKS, 33)[-1]
    reference = ReferenceDrone(drone.settings, (0.0, 0.0, 100.0)).fly(modes, goal, TICKS)
    assert np.abs(after.position[0].numpy() - reference.position).max() < 0.001
    assert np.abs(after.velocity[0].numpy() - reference.velocity).max() < 0.001
    assert degrees_between(reference.rotation, matrix(after.attitude[0])) < 0.01
    np.testing.assert_allclose(after.rotors[0], reference.rotors, atol=1e-3)


def test_drift_moves_the_reference():
    drone, drift = quadrotor(), (0.5, -0.3, 0.1, 0.2)
    goals = make_goals(POSITIONS, 0.0, 0.0, 0.0, 100.0, drift=drift)
    after = drone.fly(hovering(drone), goals, 1000)
    reference = ReferenceDrone(drone.settings, (0.0, 0.0, 100.0)).fly(
        POSITIONS, goals.values[0].tolist(), 1000, drift
    )
    np.testing.assert_allclose(after.position[0], reference.position, atol=1e-4)
    np.testing.assert_allclose(after.reference[0], (1.5, -0.9, 0.3, 100.6), atol=1e-6)


def test_climb_integral_is_used_only_with_height_goals():
    drone = quadrotor()
    thrown = (Mode.ANGLE, Mode.ANGLE, Mode.ANGLE, Mode.THROTTLE)
    state = hovering(drone)
    kept = drone.fly(state, make_goals(thrown, 0.0, 0.0, 0.0, 0.9), 10).numbers[0, 21]
    assert float(kept) == pytest.approx(2 * drone.settings.hover_throttle - 1)
    gained = drone.fly(state, make_goals(VELOCITIES, 0.0, 0.0, 0.0, 0.5), 1).numbers[0, 21] - kept
    assert float(gained) == pytest.approx(2.0 * 0.5 * 0.003, rel=1e-4)


def test_drone_on_the_ground_keeps_its_tilt_under_thrust():
    drone = quadrotor(rotor_time_constant=0.0)
    state = falling(0.3)
    state.attitude[:] = doubles((0.9950042, 0.0998334, 0.0, 0.0))  # 0.2 rad
    strong, weak = (drone.push(state, doubles((share,) * 4)) for share in (0.62, 0.5))
    assert float(strong.attitude[0, 1]) > 0.09
    assert weak.attitude.tolist() == [[1, 0, 0, 0]]
    w, z = math.cos(math.radians(30.0)), math.sin(math.radians(30.0))  # heading 60 degrees
    c, s = math.cos(0.1), math.sin(0.1)
    state.attitude[:] = doubles((w * c, w * s, z * s, z * c))
    level = drone.push(state, doubles((0.5,) * 4)).attitude[0].tolist()
    assert level == pytest.approx([w, 0.0, 0.0, z], abs=1e-6)


def test_fast_drone_hits_obstacles():
    """The drone has 60 m/s, which is 6 m per command, or rotors of 100 m/s2."""
    box = Obstacles(doubles((7.0, 0.0, 100.0))[None], (0.5, 0.5, 5.0))
    none = doubles((0.0, 0.0, 0.0, 0.0))
    hit = quadrotor().fly(falling(100.0, (66.0, 0.0, 0.0)), rotor_goals(none), 34, box)
    assert hit.contact.thing.tolist() == [0] and float(hit.velocity[0, 0]) < 0
    strong = quadrotor(rotor_thrust=50.0, rotor_time_constant=0.0, air_density=0.0)
    above = Obstacles(doubles((0.0, 0.0, 103.0))[None], (0.5, 0.5, 0.5))
    risen = strong.fly(falling(100.0), rotor_goals(doubles((1.0,) * 4)), 60, above)
    assert risen.contact.thing.tolist() == [0]
