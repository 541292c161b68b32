"""All sensors together, their random streams, and collisions."""

import dataclasses
import math

import pytest
import torch

from drone_rl.config.sensors import GpsSettings, SensorSettings
from drone_rl.sim.dynamics.state import (
    GROUND,
    NOTHING,
    THING,
    TIME,
    BodyState,
    Contact,
    FlightState,
)
from drone_rl.sim.sensors import SensorSuite
from drone_rl.sim.sensors import suite as collisions
from drone_rl.utils.errors import InputError
from tests.perfect_sensors import without_noise


def resting(count, z=3.0):
    position = torch.zeros(count, 3, dtype=torch.float64)
    position[:, 2] = z
    return BodyState.at_rest(position)


def touching(thing, seconds):
    """Return the state of a quadrotor that has touched something."""
    state = FlightState.at_rest(resting(1).position)
    state.numbers[:, THING], state.numbers[:, TIME] = thing, seconds
    return state


def tensors(state):
    """Return all tensors of a state in order."""
    found = []
    for value in vars(state).values():
        found += [value] if isinstance(value, torch.Tensor) else tensors(value)
    return found


def same(a, b):
    return all(torch.equal(x, y) for x, y in zip(tensors(a), tensors(b), strict=True))


def reading(suite, name, state):
    return getattr(suite, name).read(getattr(state, name), state.time)


def test_ideal_sensors_of_a_hovering_drone():
    suite = SensorSuite(without_noise(SensorSettings(gps=GpsSettings(startup=0.0, latency=0.0))))
    state = suite.start(resting(2))
    for _ in range(10):
        state = suite.update(state, resting(2), 0.003)
    assert state.time.tolist() == pytest.approx([0.03] * 2)
    assert reading(suite, "imu", state).specific_force[0].tolist() == pytest.approx(
        [0.0, 0.0, 9.81]
    )
    assert reading(suite, "barometer", state).altitude.tolist() == pytest.approx([125.0] * 2)
    assert reading(suite, "magnetometer", state).field[0, 2].item() < -0.4
    assert reading(suite, "gps", state).place[1].tolist() == pytest.approx(
        [47.641468, -122.140165, 125]
    )
    assert suite.read_collision(state)[0].has_collided.tolist() == [False, False]


def test_contacts_of_quadrotors_are_reported():
    suite = SensorSuite()
    state = suite.start(FlightState.at_rest(resting(1).position))
    assert not suite.read_collision(state)[0].has_collided.item()
    state = suite.update(state, touching(2, 0.003), 0.003)
    readings, after = suite.read_collision(state)
    assert readings.has_collided.item() and readings.contact.thing.item() == 2
    assert not suite.read_collision(after)[0].has_collided.item()
    assert same(dataclasses.replace(after, collision=state.collision), state)
    grounded = suite.start(touching(GROUND, 0.0))
    assert suite.read_collision(grounded)[0].contact.thing.item() == GROUND


def test_noise_depends_only_on_the_seed():
    def flown(**choice):
        suite = SensorSuite(**choice)
        state = suite.start(resting(3))
        return suite.update(state, resting(3), 0.021)

    assert same(flown(seed=4), flown(seed=4))
    for other in ({"seed": 5}, {"seed": 4, "number": 1}):
        assert not same(flown(seed=4), flown(**other))
    with pytest.raises(InputError, match="whole number"):
        SensorSuite(seed=-1)


def test_sensors_use_separate_random_streams():
    """The rate of the GPS does not change the readings of other sensors."""
    settings = SensorSettings(gps=GpsSettings(rate=10.0, startup=0.0))
    first, second = SensorSuite(), SensorSuite(settings)
    one, two = first.start(resting(2)), second.start(resting(2))
    for _ in range(20):
        one, two = first.update(one, resting(2), 0.01), second.update(two, resting(2), 0.01)
    assert same(one.imu, two.imu) and same(one.barometer, two.barometer)
    assert same(one.magnetometer, two.magnetometer)


def test_partial_reset_restarts_sensors():
    suite = SensorSuite()
    state = suite.start(resting(3))
    state = suite.update(state, resting(3), 2.0)
    state[torch.tensor([1])] = suite.start(resting(1))
    assert state.time.tolist() == [2.0, 0.0, 2.0]
    readings = reading(suite, "gps", state)
    assert readings.time.tolist() == [-math.inf] * 3
    state = suite.update(state, resting(3), 0.2)
    assert reading(suite, "gps", state).is_valid.tolist() == [True, False, True]


def contact(things, times):
    """Return contacts at distinct positions."""
    count = len(things)
    numbers = torch.arange(1.0, count + 1, dtype=torch.float64)
    up = torch.tensor([[0.0, 0.0, 1.0]], dtype=torch.float64).repeat(count, 1)
    time = torch.tensor(times, dtype=torch.float64)
    return Contact(torch.tensor(things), up, up * numbers[:, None], 0.01 * numbers, time)


def place(x):
    return torch.full((2, 3), float(x), dtype=torch.float64)


def test_collision_is_kept_until_it_is_read():
    state = collisions.start_collisions(place(0))
    assert state.has_collided.tolist() == [False, False]
    state = collisions.update_collisions(state, contact([NOTHING] * 2, [0.0] * 2), place(1))
    assert state.has_collided.tolist() == [False, False]
    touched = contact([NOTHING, 3], [0.0, 0.5])
    state = collisions.update_collisions(state, touched, place(2))
    state = collisions.update_collisions(state, touched, place(3))
    assert state.has_collided.tolist() == [False, True]
    collision, state = collisions.read_collisions(state)
    assert collision.has_collided.tolist() == [False, True]
    assert collision.contact.thing.tolist() == [NOTHING, 3]
    assert collision.contact.normal[1].tolist() == [0.0, 0.0, 1.0]
    assert collision.contact.point[1].tolist() == [0.0, 0.0, 2.0]
    assert collision.contact.depth[1].item() == 0.02
    assert collision.contact.time[1].item() == 0.5
    assert collision.position[1].tolist() == [2.0, 2.0, 2.0]
    again, state = collisions.read_collisions(state)
    assert again.has_collided.tolist() == [False, False]
    assert again.contact.thing.tolist() == [NOTHING, 3]
    state = collisions.update_collisions(state, touched, place(4))
    assert state.has_collided.tolist() == [False, False]


def test_later_contact_with_the_same_object_is_new():
    state = collisions.update_collisions(
        collisions.start_collisions(place(0)), contact([GROUND] * 2, [0.0] * 2), place(1)
    )
    _, state = collisions.read_collisions(state)
    state = collisions.update_collisions(state, contact([GROUND] * 2, [0.0, 0.003]), place(2))
    assert state.has_collided.tolist() == [False, True]
    assert state.position[:, 0].tolist() == [1.0, 2.0]


def test_collisions_are_read_per_drone():
    state = collisions.update_collisions(
        collisions.start_collisions(place(0)), contact([1, 2], [0.1] * 2), place(1)
    )
    collision, after = collisions.read_collisions(state, torch.tensor([1]))
    assert collision.contact.thing.tolist() == [2]
    assert after.has_collided.tolist() == [True, False]
    assert state.has_collided.tolist() == [True, True]
