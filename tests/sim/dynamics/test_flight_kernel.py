"""The same numbers whoever flies beside a drone, and nothing lost between commands."""

import numpy as np
import pytest
import torch

from drone_rl.sim.dynamics import FlightState, Mode
from drone_rl.sim.dynamics.state import NUMBERS
from drone_rl.sim.rendering.devices import WorkerPool
from tests.flying import (
    ANGLES,
    POSITIONS,
    VELOCITIES,
    doubles,
    falling,
    hovering,
    make_goals,
    quadrotor,
)


def crowd(drone, count=96):
    """Drones that are all told something else, in gusts of their own."""
    source = np.random.default_rng(1)
    state = hovering(drone, count=count, seeds=torch.arange(count))
    goals = make_goals(POSITIONS, 0, 0, 0, 100.0, count=count)
    goals.values[:, :2] = torch.tensor(source.uniform(-5, 5, (count, 2)))
    goals.values[:, 2] = torch.tensor(source.uniform(-3, 3, count))
    return state, goals


def test_one_thread_or_two_alone_or_among_others():
    drone = quadrotor(gusts=1.0, wind=(2.0, 0.0, 0.0))
    state, goals = crowd(drone)
    both = drone.fly(state, goals, 330).numbers
    alone = quadrotor(gusts=1.0, wind=(2.0, 0.0, 0.0))
    vars(alone)["_workers"] = WorkerPool(1, size=1)
    assert torch.equal(alone.fly(state, goals, 330).numbers, both)
    vars(alone)["_workers"] = WorkerPool(96, size=3)
    assert torch.equal(alone.fly(state, goals, 330).numbers, both)
    for world in (0, 17, 95):
        one = FlightState(state.numbers[world : world + 1].clone())
        told_one = make_goals(POSITIONS, *goals.values[world].tolist())
        assert torch.equal(drone.fly(one, told_one, 330).numbers[0], both[world])


def test_what_is_given_stays_as_it_was():
    drone = quadrotor()
    state = hovering(drone)
    before = state.numbers.clone()
    drone.fly(state, make_goals(POSITIONS, 1.0, 0.0, 0.0, 100.0), 33)
    assert torch.equal(state.numbers, before)


@pytest.mark.parametrize(
    ("modes", "goal"),
    [(POSITIONS, (2, 1, 1, 101)), (VELOCITIES, (2, 1, 1, 1)), (ANGLES, (0.3, 0.2, 1, 99))],
)
def test_one_command_of_66_ticks_is_two_of_33(modes, goal):
    """But for what single precision rounds: less than a micrometre."""
    drone = quadrotor()
    whole = drone.fly(hovering(drone), make_goals(modes, *goal), 66)
    half = drone.fly(
        drone.fly(hovering(drone), make_goals(modes, *goal), 33), make_goals(modes, *goal), 33
    )
    assert float((whole.numbers - half.numbers)[:, :13].abs().max()) < 1e-6
    assert whole.ticks.tolist() == half.ticks.tolist() == [66]


def test_far_away_nothing_is_lost():
    """A hundred kilometres from the origin a drone flies as it does there."""
    drone, far = quadrotor(), doubles((1e5, -1e5, 0.0))
    near = drone.fly(hovering(drone), make_goals(POSITIONS, 1.0, 2.0, 0.0, 101.0), 330)
    state = hovering(drone)
    state.position[:] += far
    goal = make_goals(POSITIONS, 1e5 + 1.0, -1e5 + 2.0, 0.0, 101.0)
    away = drone.fly(state, goal, 330)
    np.testing.assert_allclose(away.position - far, near.position, atol=1e-9)


def test_where_a_drone_is_wanted_is_written_down():
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
def test_a_lost_drone_stays_flagged_and_still_and_harms_no_other(name):
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
def test_a_drone_that_is_told_no_number_is_lost(modes, bad):
    drone = quadrotor()
    for axis in range(4):
        goal = [0.0, 0.0, 0.0, 0.0]
        goal[axis] = bad
        assert drone.fly(hovering(drone), make_goals(modes, *goal), 3).is_lost.item()


def test_a_drone_that_spins_out_of_all_measure_is_lost():
    drone = quadrotor(rotor_thrust=10_000.0, inertia=(1e-6, 1e-6, 1e-6))
    after = drone.push(falling(), doubles((0.0, 1.0, 1.0, 0.0)), 10)
    assert after.is_lost.item() and after.position.tolist() == [[0, 0, 100]]


def test_time_and_contacts_go_on_from_command_to_command():
    drone = quadrotor()
    state = falling(0.8)
    none = doubles((0.0, 0.0, 0.0, 0.0))
    assert state.numbers.shape == (1, NUMBERS) and state.contact.thing.tolist() == [-2]
    for _ in range(4):
        state = drone.push(state, none, 30)
    assert state.ticks.tolist() == [120]
    first = float(state.contact.time)  # 0.5 m take 0.319 s
    assert first == pytest.approx(0.319, abs=0.007)
    later = drone.push(state, none, 1)
    assert float(later.contact.time) == first  # it is in the air, and still knows
