import dataclasses
import math

import pytest
import torch

from drone_rl.config.sensors import GpsSettings, SensorSettings
from drone_rl.sim.dynamics.state import GROUND, THING, TIME, BodyState, FlightState
from drone_rl.sim.sensors import SensorSuite
from drone_rl.utils.errors import InputError


def resting(count, z=3.0):
    position = torch.zeros(count, 3, dtype=torch.float64)
    position[:, 2] = z
    return BodyState.at_rest(position)


def touching(thing, seconds):
    """A drone in flight that has touched something."""
    state = FlightState.at_rest(resting(1).position)
    state.numbers[:, THING], state.numbers[:, TIME] = thing, seconds
    return state


def tensors(state):
    """All numbers of a state, in order."""
    found = []
    for value in vars(state).values():
        found += [value] if isinstance(value, torch.Tensor) else tensors(value)
    return found


def same(a, b):
    return all(torch.equal(x, y) for x, y in zip(tensors(a), tensors(b), strict=True))


def reading(senses, name, state):
    return getattr(senses, name).read(getattr(state, name), state.time)


def test_perfect_senses_of_a_hovering_drone():
    senses = SensorSuite(SensorSettings(gps=GpsSettings(startup=0.0, latency=0.0)).perfect)
    state = senses.start(resting(2))
    for _ in range(10):
        state = senses.update(state, resting(2), 0.003)
    assert state.time.tolist() == pytest.approx([0.03] * 2)
    assert reading(senses, "imu", state).specific_force[0].tolist() == pytest.approx(
        [0.0, 0.0, 9.81]
    )
    assert reading(senses, "barometer", state).altitude.tolist() == pytest.approx([125.0] * 2)
    assert reading(senses, "magnetometer", state).field[0, 2].item() < -0.4
    assert reading(senses, "gps", state).place[1].tolist() == pytest.approx(
        [47.641468, -122.140165, 125]
    )
    assert senses.read_collision(state)[0].has_collided.tolist() == [False, False]


def test_drones_in_flight_tell_what_they_touched():
    senses = SensorSuite()
    state = senses.start(FlightState.at_rest(resting(1).position))
    assert not senses.read_collision(state)[0].has_collided.item()
    state = senses.update(state, touching(2, 0.003), 0.003)
    told, after = senses.read_collision(state)
    assert told.has_collided.item() and told.contact.thing.item() == 2
    assert not senses.read_collision(after)[0].has_collided.item()
    assert same(dataclasses.replace(after, collision=state.collision), state)
    grounded = senses.start(touching(GROUND, 0.0))
    assert senses.read_collision(grounded)[0].contact.thing.item() == GROUND


def test_nothing_is_a_view_of_the_drones_own_numbers():
    """Kernels write into these."""
    senses, body = SensorSuite(), touching(3, 0.5)
    state = senses.update(senses.start(body), body, 0.003)
    before = [part.clone() for part in tensors(state)]
    body.numbers[:] = 9.0
    assert all(torch.equal(a, b) for a, b in zip(before, tensors(state), strict=True))


def test_the_seed_alone_decides_the_noise():
    def flown(**choice):
        senses = SensorSuite(**choice)
        state = senses.start(resting(3))
        return senses.update(state, resting(3), 0.021)

    assert same(flown(seed=4), flown(seed=4))
    for other in ({"seed": 5}, {"seed": 4, "number": 1}):
        assert not same(flown(seed=4), flown(**other))
    with pytest.raises(InputError, match="whole number"):
        SensorSuite(seed=-1)


def test_nothing_is_drawn_where_nothing_is_due():
    """Between the readings of sensors that take 50 a second."""
    senses, others = SensorSuite(), SensorSuite()
    one, two = senses.start(resting(2)), others.start(resting(2))
    for _ in range(6):
        one = senses.update(one, resting(2), 0.003)
    one, two = senses.update(one, resting(2), 0.003), others.update(two, resting(2), 0.021)
    told = (
        reading(senses, "barometer", one),
        reading(others, "barometer", two),
    )
    assert torch.equal(told[0].pressure, told[1].pressure)
    assert told[0].time.tolist() == pytest.approx([0.021] * 2)
    told = (
        reading(senses, "magnetometer", one),
        reading(others, "magnetometer", two),
    )
    assert torch.equal(told[0].field, told[1].field)


def test_sensors_draw_from_streams_of_their_own():
    """A GPS of another rate changes nothing in what the others read."""
    settings = SensorSettings(gps=GpsSettings(rate=10.0, startup=0.0))
    first, second = SensorSuite(), SensorSuite(settings)
    one, two = first.start(resting(2)), second.start(resting(2))
    for _ in range(20):
        one, two = first.update(one, resting(2), 0.01), second.update(two, resting(2), 0.01)
    assert same(one.imu, two.imu) and same(one.barometer, two.barometer)
    assert same(one.magnetometer, two.magnetometer)


def test_some_drones_begin_anew():
    senses = SensorSuite()
    state = senses.start(resting(3))
    state = senses.update(state, resting(3), 2.0)
    state[torch.tensor([1])] = senses.start(resting(1))
    assert state.time.tolist() == [2.0, 0.0, 2.0]
    told = reading(senses, "gps", state)
    assert told.time.tolist() == [-math.inf] * 3
    state = senses.update(state, resting(3), 0.2)
    assert reading(senses, "gps", state).is_valid.tolist() == [True, False, True]
