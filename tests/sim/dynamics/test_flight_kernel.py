"""All ticks of a command: precision, independence of batch and commands, contacts, lost drones."""

import math

import numpy as np
import pytest
import torch

from drone_rl.sim.dynamics import FlightState, Mode, Obstacles
from drone_rl.sim.dynamics.control import rotor_goals
from drone_rl.sim.dynamics.state import NUMBERS
from drone_rl.sim.rendering.devices import WorkerPool
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


def make_batch(drone, count=96):
    """Return drones with distinct goals and gusts."""
    source = np.random.default_rng(1)
    state = hovering(drone, count=count, seeds=torch.arange(count))
    goals = make_goals(POSITIONS, 0, 0, 0, 100.0, count=count)
    goals.values[:, :2] = torch.tensor(source.uniform(-5, 5, (count, 2)))
    goals.values[:, 2] = torch.tensor(source.uniform(-3, 3, count))
    return state, goals


def test_results_do_not_depend_on_threads_or_batch():
    drone = quadrotor(gusts=1.0, wind=(2.0, 0.0, 0.0))
    state, goals = make_batch(drone)
    both = drone.fly(state, goals, 330).numbers
    alone = quadrotor(gusts=1.0, wind=(2.0, 0.0, 0.0))
    vars(alone)["_workers"] = WorkerPool(1, size=1)
    assert torch.equal(alone.fly(state, goals, 330).numbers, both)
    vars(alone)["_workers"] = WorkerPool(96, size=3)
    assert torch.equal(alone.fly(state, goals, 330).numbers, both)
    for world in (0, 17, 95):
        one = FlightState(state.numbers[world : world + 1].clone())
        single_goals = make_goals(POSITIONS, *goals.values[world].tolist())
        assert torch.equal(drone.fly(one, single_goals, 330).numbers[0], both[world])


def test_precision_does_not_depend_on_the_distance_to_the_origin():
    """A drone 100 km from the origin moves as at the origin."""
    drone, far = quadrotor(), doubles((1e5, -1e5, 0.0))
    near = drone.fly(hovering(drone), make_goals(POSITIONS, 1.0, 2.0, 0.0, 101.0), 330)
    state = hovering(drone)
    state.position[:] += far
    goal = make_goals(POSITIONS, 1e5 + 1.0, -1e5 + 2.0, 0.0, 101.0)
    away = drone.fly(state, goal, 330)
    np.testing.assert_allclose(away.position - far, near.position, atol=1e-9)


def test_reference_is_the_goal_position():
    drone = quadrotor()
    places = drone.fly(hovering(drone), make_goals(POSITIONS, 1.0, 2.0, 0.5, 101.0), 33)
    np.testing.assert_allclose(places.reference[0], (1.0, 2.0, 0.5, 101.0))
    speeds = drone.fly(hovering(drone), make_goals(VELOCITIES, 1.0, 2.0, 0.5, 1.0), 33)
    expected = [*speeds.position[0, :2], speeds.heading[0], speeds.position[0, 2]]
    np.testing.assert_allclose(speeds.reference[0], expected, atol=1e-6)


BROKEN = {
    "position": np.nan,
    "velocity": 2000.0,
    "angular_velocity": np.inf,
    "rotors": np.nan,
    "attitude": 0.0,
    "gust": np.nan,
}


@pytest.mark.parametrize("name", BROKEN)
def test_lost_drone_stays_flagged_and_does_not_affect_others(name):
    drone = quadrotor()
    state = hovering(drone, count=3)
    goals = make_goals(POSITIONS, 1.0, 0.0, 0.0, 100.0, count=3)
    well = drone.fly(drone.fly(state, goals, 33), goals, 33)
    getattr(state, name)[1] = BROKEN[name]
    before = state.position[1].clone()
    once = drone.fly(state, goals, 33)
    twice = drone.fly(once, goals, 33)
    for after in (once, twice):
        assert after.is_lost.tolist() == [False, True, False]
        assert not after.velocity[1].any() and not after.angular_velocity[1].any()
        assert torch.equal(after.position[1].nan_to_num(), before.nan_to_num())
    assert torch.equal(twice.numbers[::2], well.numbers[::2])


@pytest.mark.parametrize("modes", [POSITIONS, VELOCITIES, ANGLES, (Mode.ROTOR,) * 4])
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_nan_goals_lose_the_drone(modes, bad):
    drone = quadrotor()
    for axis in range(4):
        goal = [0.0, 0.0, 0.0, 0.0]
        goal[axis] = bad
        assert drone.fly(hovering(drone), make_goals(modes, *goal), 3).is_lost.item()


def test_drone_with_excessive_spin_is_lost():
    drone = quadrotor(rotor_thrust=10_000.0, inertia=(1e-6, 1e-6, 1e-6))
    after = drone.push(falling(), doubles((0.0, 1.0, 1.0, 0.0)), 10)
    assert after.is_lost.item() and after.position.tolist() == [[0, 0, 100]]


def test_time_and_contacts_continue_across_commands():
    drone = quadrotor()
    state = falling(0.8)
    none = doubles((0.0, 0.0, 0.0, 0.0))
    assert state.numbers.shape == (1, NUMBERS) and state.contact.thing.tolist() == [-2]
    for _ in range(4):
        state = drone.push(state, none, 30)
    assert state.ticks.tolist() == [120]
    first = float(state.contact.time)  # a fall of 0.5 m takes 0.319 s
    assert first == pytest.approx(0.319, abs=0.007)
    later = drone.push(state, none, 1)
    assert float(later.contact.time) == first  # the contact is kept in the air


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
