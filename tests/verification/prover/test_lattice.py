"""Moves and rules on the lattice, against the simulator's own rules."""

import dataclasses

import numpy as np
import pytest
import torch

from drone_rl.config import TaskSettings
from drone_rl.sim.dynamics import ComputerVision
from drone_rl.sim.tasks import CollectCubes
from drone_rl.sim.tasks.collect_cubes import EndReason
from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.boxes import all_placements, volumes
from drone_rl.verification.prover.lattice import AHEAD, LEFT, RIGHT, Ending, Lattice, LatticeState

TASK = TaskSettings(num_cubes=2, step_limit=60)


def moves(place, action, boxes, lattice=None):
    found = {}
    for moved, part in (lattice or Lattice(TASK)).move(place, action, boxes):
        found[moved] = np.concatenate([found.get(moved, part[:0]), part])
    return found


def test_a_step_ahead_past_nothing():
    (moved,) = moves(LatticeState(3, 1, 0, 4), AHEAD, all_placements(6, 2))
    assert moved == LatticeState(4, 1, 0, 5, AHEAD)


def test_a_cube_is_touched_where_it_is_near_enough():
    """At x=14 the first cube is 1 m ahead: touched where |y - 2| <= 1.65."""
    found = moves(LatticeState(13, 2), AHEAD, all_placements(6, 2))
    sizes = {place.collected: volumes(part).sum() / 12 for place, part in found.items()}
    assert sizes == pytest.approx({0: 12 - 3.3, 1: 3.3})


def test_a_cube_that_is_left_behind_is_touched_no_more():
    """At x=16 the first cube, at 15, has been passed, near as it is."""
    (moved,) = moves(LatticeState(16, -3), LEFT, all_placements(6, 2))
    assert moved.collected == 0


def test_collecting_ends_a_way_to_the_side():
    """Whoever has collected sees another image, so that the way back is no loop."""
    found = moves(LatticeState(14, 0), LEFT, all_placements(6, 2))
    assert {p.collected: p.came for p in found} == {0: LEFT, 1: AHEAD}


def test_borders_are_the_simulators_to_the_last_bit():
    lattice = Lattice(TASK)
    (touched,) = [
        b for p, b in moves(LatticeState(13, 2), AHEAD, all_placements(6, 2)).items() if p.collected
    ]
    low, high = touched[0, 0]
    for y, expected in ((low, True), (np.nextafter(low, -9), False)):
        assert (abs(2.0 - y) <= TASK.touch_distance) == expected
    for y, expected in ((np.nextafter(high, -9), True), (high, False)):
        assert (abs(2.0 - y) <= TASK.touch_distance) == expected
    assert lattice.everything == 0b11


@pytest.mark.parametrize(
    ("place", "reason"),
    [
        (LatticeState(3, 0), None),
        (LatticeState(36, 0), EndReason.FRONT_BOUNDARY),  # the front boundary is at 35
        (LatticeState(35, 0), None),
        (LatticeState(3, 27), EndReason.SIDE_BOUNDARY),
        (LatticeState(3, -26), None),
        (LatticeState(3, 0, 0, 60), EndReason.STEP_LIMIT),
        (LatticeState(36, 27, 0, 60), EndReason.FRONT_BOUNDARY),
        (LatticeState(36, 27, 0b11, 60), EndReason.ALL_CUBES),
    ],
)
def test_endings_in_their_order(place, reason):
    ending = Lattice(TASK).ending(place)
    assert ending == (None if reason is None else Ending(reason, place.collected))


def test_cubes_in_sight():
    lattice = Lattice(TASK)
    assert lattice.standing(LatticeState(15, 0)) == [0, 1]
    assert lattice.standing(LatticeState(16, 0)) == [1]
    assert lattice.standing(LatticeState(3, 0, 0b10)) == [0]
    assert lattice.standing(LatticeState(25, 0)) == []


def test_random_walks_end_as_the_simulator_has_it():
    random, lattice = np.random.default_rng(0), Lattice(TASK)
    for _ in range(100):
        y = random.uniform(-6, 6, 2)
        cubes = torch.tensor([[[15.0, y[0], 2.5], [24.0, y[1], 2.5]]], dtype=torch.float64)
        state, place = CollectCubes(TASK).start(cubes), LatticeState(0, 0)
        dynamics = ComputerVision(TASK.step_length)
        while True:
            action = int(random.choice([AHEAD, AHEAD, AHEAD, LEFT, RIGHT]))
            body = dynamics.step(state.body, torch.tensor([action]))
            state, _ = CollectCubes(TASK).step(state, body)
            boxes = np.stack([y, np.nextafter(y, 9)], -1)[None]
            ((place, _),) = moves(place, action, boxes, lattice).items()
            collected = sum(int(c) << k for k, c in enumerate(state.collected[0]))
            assert place.collected == collected
            ending = lattice.ending(place)
            assert (0 if ending is None else ending.reason) == int(state.end_reason)
            if ending:
                break


def test_no_place_comes_before_one_that_leads_to_it():
    lattice = Lattice(TASK)
    random = np.random.default_rng(1)
    for _ in range(300):
        place = LatticeState(
            int(random.integers(0, 30)), int(random.integers(-9, 9)), 0, 5, int(random.integers(3))
        )
        for action in (AHEAD, LEFT, RIGHT):
            if {place.came, action} == {LEFT, RIGHT}:
                continue
            for moved in moves(place, action, all_placements(6, 2), lattice):
                assert moved.turn > place.turn


def test_steps_that_round_are_refused():
    with pytest.raises(InputError, match=r"step_length=0.1 are rounded"):
        Lattice(dataclasses.replace(TASK, step_length=0.1, step_limit=900))
    with pytest.raises(InputError, match=r"are rounded, so .* or differ between simulator"):
        Lattice(dataclasses.replace(TASK, step_length=1 + 2**-30))  # no float32
    Lattice(dataclasses.replace(TASK, step_length=0.75))
