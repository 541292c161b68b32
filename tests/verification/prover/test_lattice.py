"""Moves on the lattice and the graph of all nodes, compared with the simulator's rules."""

import math

import numpy as np
import pytest
import torch

from drone_rl.config import TaskSettings
from drone_rl.sim.dynamics import ComputerVision
from drone_rl.sim.tasks import CollectCubes
from drone_rl.sim.tasks.collect_cubes import CubesEnd
from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.boxes import all_placements
from drone_rl.verification.prover.lattice import (
    AHEAD,
    LEFT,
    RIGHT,
    Ending,
    Lattice,
    LatticeState,
    explore,
    shape_of,
)

TASK = TaskSettings(num_cubes=2, step_limit=60)


def moves(place, action, boxes, lattice=None):
    found = {}
    for moved, part in (lattice or Lattice(TASK)).move(place, action, boxes):
        found[moved] = np.concatenate([found.get(moved, part[:0]), part])
    return found


def test_collecting_resets_the_last_sideways_move():
    """Whoever has collected sees another image, so that the way back is no loop."""
    found = moves(LatticeState(14, 0), LEFT, all_placements(6, 2))
    assert {p.collected: p.came for p in found} == {0: LEFT, 1: AHEAD}


def test_touch_borders_are_exact():
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
        (LatticeState(36, 0), CubesEnd.FRONT_BOUNDARY),  # the front boundary is at 35
        (LatticeState(35, 0), None),
        (LatticeState(3, 27), CubesEnd.SIDE_BOUNDARY),
        (LatticeState(3, -26), None),
        (LatticeState(3, 0, 0, 60), CubesEnd.STEP_LIMIT),
        (LatticeState(36, 27, 0, 60), CubesEnd.FRONT_BOUNDARY),
        (LatticeState(36, 27, 0b11, 60), CubesEnd.ALL_CUBES),
    ],
)
def test_order_of_endings(place, reason):
    ending = Lattice(TASK).ending(place)
    assert ending == (None if reason is None else Ending(reason, place.collected))


def test_random_walks_on_the_lattice():
    random, lattice = np.random.default_rng(0), Lattice(TASK)
    for _ in range(40):
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
            collected = sum(int(c) << k for k, c in enumerate(state.reached[0]))
            assert place.collected == collected
            ending = lattice.ending(place)
            assert (0 if ending is None else ending.reason) == int(state.end_reason)
            if ending:
                break


def test_order_of_states():
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


def test_rounded_step_lengths_are_refused():
    with pytest.raises(InputError, match=r"step_length=0.1 are rounded"):
        Lattice(TASK.replace(step_length=0.1, step_limit=900))
    with pytest.raises(InputError, match=r"are rounded, so .* or differ between simulator"):
        Lattice(TASK.replace(step_length=1 + 2**-30))  # no float32
    Lattice(TASK.replace(step_length=0.75))


def test_graph_by_hand(small, place):
    graph = explore(small, place(small, [0.0]))
    places = zip(graph.nodes.ahead.tolist(), graph.nodes.aside.tolist(), strict=True)
    assert list(places) == [(0, 0), (0, -1), (0, 1)]
    assert graph.target.tolist() == [[-1, 2, 1], [-1, 0, -1], [-1, -1, 0]]
    assert graph.reason.tolist() == [[1, 0, 0], [1, 0, 3], [1, 3, 0]]  # forward touches the cube
    assert graph.collected.tolist() == [[1, 0, 0], [1, 0, 0], [1, 0, 0]]


TASKS = [
    TaskSettings(side_margin=2.0),
    TaskSettings(num_cubes=2, vertical_bound=0.5, spacing=1.0, side_margin=0.5),
    TaskSettings(num_cubes=4, step_length=0.7, spacing=2.5, first_distance=3.0, side_margin=1.0),
]


@pytest.mark.parametrize("settings", TASKS, ids=("three", "two", "four"))
def test_random_walks_on_the_graph(settings):
    random = np.random.RandomState(0)
    walks = 24
    cubes = torch.stack([CollectCubes(settings).sample(random) for _ in range(walks)])
    graph = explore(settings, cubes)
    every = graph.states()
    dynamics = ComputerVision(settings.step_length)
    state, node = CollectCubes(settings).start(cubes), torch.arange(walks)
    ends = torch.zeros(5)
    bit = torch.arange(settings.num_cubes)
    for _ in range(settings.step_limit - 1):
        shown = every[node]
        assert torch.allclose(shown.drone, state.drone, atol=1e-12, rtol=0)
        for name in ("places", "reached", "present", "end_reason"):
            assert torch.equal(getattr(shown, name), getattr(state, name)), name
        action = torch.from_numpy(random.choice(3, len(state), p=[0.4, 0.35, 0.25]))
        state, _ = CollectCubes(settings).step(state, dynamics.step(state.body, action))
        assert torch.equal(graph.reason[node, action], state.end_reason)
        collected = (graph.collected[node, action][:, None] >> bit & 1).bool()
        assert torch.equal(collected, state.reached)
        ends += torch.bincount(state.end_reason, minlength=5)
        going = state.end_reason == 0
        node, state = graph.target[node, action][going], state[going]
        if not len(state):
            break
    assert (ends[1:4] > 0).sum() >= 2  # the walks met more than one kind of end


def test_nodes_with_equal_images(place):
    settings = TaskSettings(num_cubes=2)
    graph = explore(settings, place(settings, [0.0, 5.0], [0.0, 5.0]))
    node, image = graph.images()
    state = graph.states()
    view = torch.cat([graph.nodes.placement[:, None].double(), state.drone, state.present], -1)
    assert torch.equal(view[node][image], view)
    assert len(node) == len(view.unique(dim=0)) < len(view)


def test_too_many_nodes_are_refused():
    assert math.prod(shape_of(TaskSettings())) < 50_000
    with pytest.raises(InputError, match=r"num_cubes=20 .* give fewer cubes"):
        shape_of(TaskSettings(num_cubes=20))
