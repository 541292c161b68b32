"""The graph says of every walk what the rules say of it."""

import dataclasses
import math

import numpy as np
import pytest
import torch

from drone_rl.config import TaskSettings
from drone_rl.sim.dynamics import ComputerVision
from drone_rl.sim.tasks import CollectCubes
from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.lattice import Nodes, explore, shape_of


def test_a_lattice_counted_by_hand(small, place):
    graph = explore(small, place(small, [0.0]))
    places = zip(graph.nodes.ahead.tolist(), graph.nodes.aside.tolist(), strict=True)
    assert list(places) == [(0, 0), (0, -1), (0, 1)]
    assert graph.target.tolist() == [[-1, 2, 1], [-1, 0, -1], [-1, -1, 0]]
    assert graph.reason.tolist() == [[1, 0, 0], [1, 0, 3], [1, 3, 0]]  # forward touches the cube
    assert graph.collected.tolist() == [[1, 0, 0], [1, 0, 0], [1, 0, 0]]


def test_every_placement_starts_in_a_cell_of_its_own_and_never_leaves_it(place):
    settings = TaskSettings(num_cubes=1)
    graph = explore(settings, place(settings, [6.0], [0.0], [-6.0]))
    assert graph.nodes.placement[:3].tolist() == [0, 1, 2]
    assert graph.states().drone[:3].tolist() == [[0.0, 0.0, settings.altitude]] * 3
    goes_on = graph.target >= 0
    after = graph.nodes.placement[graph.target]
    assert torch.equal(after[goes_on], graph.nodes.placement[:, None].expand(-1, 3)[goes_on])


TASKS = [
    TaskSettings(side_margin=2.0),
    TaskSettings(num_cubes=2, vertical_bound=0.5, spacing=1.0, side_margin=0.5),
    TaskSettings(num_cubes=4, step_length=0.7, spacing=2.5, first_distance=3.0, side_margin=1.0),
]


@pytest.mark.parametrize("settings", TASKS, ids=("three", "two", "four"))
def test_random_walks_go_as_the_rules_have_it(settings):
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
        for name in ("cubes", "collected", "passed", "next_cube", "end_reason"):
            assert torch.equal(getattr(shown, name), getattr(state, name)), name
        action = torch.from_numpy(random.choice(3, len(state), p=[0.4, 0.35, 0.25]))
        state, _ = CollectCubes(settings).step(state, dynamics.step(state.body, action))
        assert torch.equal(graph.reason[node, action], state.end_reason)
        collected = (graph.collected[node, action][:, None] >> bit & 1).bool()
        assert torch.equal(collected, state.collected)
        ends += torch.bincount(state.end_reason, minlength=5)
        going = state.end_reason == 0
        node, state = graph.target[node, action][going], state[going]
        if not len(state):
            break
    assert (ends[1:4] > 0).sum() >= 2  # the walks met more than one kind of end


def test_cells_that_look_alike_share_a_picture_and_no_others(place):
    settings = TaskSettings(num_cubes=2)
    graph = explore(settings, place(settings, [0.0, 5.0], [0.0, 5.0]))
    node, image = graph.images()
    state = graph.states()
    view = torch.cat([graph.nodes.placement[:, None].double(), state.drone, state.present], -1)
    assert torch.equal(view[node][image], view)
    assert len(node) == len(view.unique(dim=0)) < len(view)


def test_x_is_the_sum_of_the_steps_rounded_as_in_the_simulator(place):
    settings = TaskSettings(num_cubes=1, step_length=0.1, side_margin=0.5, lateral_bound=0.5)
    graph = explore(settings, place(settings, [0.0]))
    x = sum([0.1] * 30)
    assert x != 30 * 0.1
    assert (graph.states().drone[:, 0] == x).any()


def test_cells_behave_like_a_batch():
    nodes = Nodes(*torch.arange(8).view(4, 2))
    assert len(nodes) == 2
    assert dataclasses.astuple(nodes[torch.tensor([1])]) == (1, 3, 5, 7)


def test_too_many_cells_are_refused():
    assert math.prod(shape_of(TaskSettings())) < 50_000
    with pytest.raises(InputError, match=r"num_cubes=20 .* give fewer cubes"):
        shape_of(TaskSettings(num_cubes=20))
