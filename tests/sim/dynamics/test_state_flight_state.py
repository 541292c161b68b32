import itertools
import math

import pytest
import torch

from drone_rl.sim.dynamics import FlightState
from drone_rl.sim.dynamics import state as fs
from tests.flying import doubles


def test_parts_are_contiguous():
    sizes = {"POSITION": 3, "ATTITUDE": 4, "VELOCITY": 3, "RATES": 3, "ROTORS": 4, "REFERENCE": 4}
    sizes |= {
        "CLIMB_INTEGRAL": 1,
        "GUST": 3,
        "SEED": 1,
        "TICKS": 1,
        "LOST": 1,
        "THING": 1,
        "NORMAL": 3,
    }
    sizes |= {"POINT": 3, "DEPTH": 1, "TIME": 1}
    ends = itertools.accumulate(sizes.values())
    assert [getattr(fs, name) for name in sizes] == [0, *ends][:-1]
    assert sum(sizes.values()) == fs.NUMBERS


def test_reference_at_rest_is_the_own_position():
    turned = doubles((math.cos(0.35), 0.0, 0.0, math.sin(0.35)))
    state = FlightState.at_rest(doubles((1.0, 2.0, 3.0)), turned, torch.tensor([5]))
    assert state.position.tolist() == [[1, 2, 3]] and not state.velocity.any()
    assert state.heading.item() == pytest.approx(0.7)
    assert state.reference[0].tolist() == pytest.approx([1.0, 2.0, 0.7, 3.0])
    assert state.numbers[0, fs.SEED] == 5 and not state.is_lost.any()
    assert state.contact.thing.tolist() == [fs.NOTHING] and state.ticks.tolist() == [0]
    assert FlightState.at_rest(doubles((0.0, 0.0, 0.0))).attitude.tolist() == [[1, 0, 0, 0]]


def test_parts_are_views_of_the_state():
    state = FlightState.at_rest(doubles((1.0, 2.0, 3.0), (4.0, 5.0, 6.0)))
    state.velocity[1] = doubles((7.0, 8.0, 9.0))
    state.rotors[:] = 0.5
    assert state.numbers[1, 7:10].tolist() == [7, 8, 9]
    assert state.numbers[0, 13:17].tolist() == [0.5] * 4


def test_moved_state_has_a_moved_reference():
    state = FlightState.at_rest(doubles((1.0, 2.0, 3.0)))
    state.velocity[:] = 1.0
    moved = state.moved(doubles((4.0, 5.0, 6.0)))
    assert moved.position.tolist() == [[4, 5, 6]] and state.position.tolist() == [[1, 2, 3]]
    assert moved.reference.tolist() == [[4, 5, 0, 6]] and moved.velocity.tolist() == [[1, 1, 1]]
    root = math.sqrt(0.5)
    turned = state.moved(state.position, doubles((root, 0.0, 0.0, root)))
    assert turned.heading.item() == pytest.approx(math.pi / 2)
    assert turned.reference[0, 2].item() == pytest.approx(math.pi / 2)
