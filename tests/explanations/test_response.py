"""Maps over the place of one target: response, outcome, exact actions; asymmetry."""

import functools

import numpy as np
import pytest
import torch

from drone_rl.config import TaskSettings
from drone_rl.explanations import response
from drone_rl.explanations.hooks import probabilities
from drone_rl.explanations.response import (
    asymmetry,
    count_places,
    find_blind,
    outcome_map,
    response_map,
    section,
    shrink,
)
from drone_rl.explanations.results import OutcomeMap, ResponseMap
from drone_rl.explanations.scenes import Scenes, place_target
from drone_rl.policies import MLP, ImageNetwork
from drone_rl.sim.actions import MOVES, Move
from drone_rl.sim.continuous_actions import ContinuousActions
from tests.continuous import SETTINGS

IDLE, LEFT = [1.0, 0.0, 0.0], [0.1, 0.9, 0.0]


class Forward(ImageNetwork):
    def forward(self, pictures):
        return torch.tensor([9.0, 0.0, 0.0]).expand(len(pictures), 3)


def test_places_of_the_grid_are_places_in_the_scene(scenes, world):
    found = response_map(scenes, world[2], num_lateral=5, num_forward=4)
    assert found.probabilities.shape == (1, 4, 5, 3)
    assert found.lateral.tolist() == [12, 6, 0, -6, -12] and found.forward[-1] == 15
    assert found.height.tolist() == [0]
    assert found.oracle.tolist() == [1, 1, 0, 2, 2]
    at = place_target(scenes, torch.tensor([found.forward[1]]), torch.tensor([found.lateral[3]]))
    expected = probabilities(world[2], scenes.observe(at))[0].numpy()
    np.testing.assert_allclose(found.probabilities[0, 1, 3], expected, atol=1e-6)


def test_places_of_a_seed_cannot_be_known_beforehand(scenes):
    task_grid = scenes.task.edits.grid(4, 5)
    one, other, again, second = (
        shrink(task_grid, s, n) for s, n in ((1, 0), (2, 0), (1, 0), (1, 1))
    )
    for axis in ("forward", "lateral"):
        own, places = getattr(task_grid, axis), getattr(one, axis)
        assert torch.equal(places, getattr(again, axis))
        for moved in (getattr(other, axis), getattr(second, axis)):
            assert not set(places.tolist()) & set(moved.tolist()) - {0.0}
        step = (own[-1] - own[0]) / (len(own) - 1)
        inwards = torch.stack([places[0] - own[0], own[-1] - places[-1]]) / step
        assert ((inwards > 0) & (inwards < 0.5)).all()
        torch.testing.assert_close(places.diff(), places.diff()[:1].expand(len(own) - 1))
    assert torch.equal(one.lateral, -one.lateral.flip(0)) and one.lateral[2] == 0.0


def test_both_maps_use_places_of_their_seed(scenes, world):
    for make, number in ((response_map, 0), (outcome_map, 1)):
        found = make(scenes, Forward(), num_lateral=3, num_forward=2, seed=9)
        expected = shrink(scenes.task.edits.grid(2, 3), 9, number)
        assert found.forward.tolist() == expected.forward.tolist()
        assert found.lateral.tolist() == expected.lateral.tolist()


def test_heights_are_those_of_the_task(make_pipeline):
    env, actor = make_pipeline(num_envs=4, task=TaskSettings(vertical_bound=1.2))
    scenes, network = Scenes(env), actor.module[0].module
    found = response_map(scenes, network, num_lateral=3, num_forward=2)
    assert found.height.tolist() == [-1.2, 0.0, 1.2]
    at = place_target(scenes, torch.tensor([15.0]), torch.tensor([12.0]), 1.2)
    assert at.places[0, 0].tolist() == [15.0, 12.0, 2.5 + 1.2]
    expected = probabilities(network, scenes.observe(at))[0].numpy()
    np.testing.assert_allclose(found.probabilities[2, 1, 0], expected, atol=1e-6)
    assert not np.allclose(found.probabilities[0], found.probabilities[2], atol=1e-6)


def test_outcomes_come_from_rollouts(scenes):
    found = outcome_map(scenes, Forward(), num_lateral=17, num_forward=2)  # 1.5 m apart
    straight = [False] * 7 + [True] * 3 + [False] * 7
    assert found.collected.tolist() == [[straight, straight]]
    assert (found.oracle == 0).tolist() == straight


def test_blindness_by_hand():
    probs = np.array([[[IDLE, LEFT, IDLE, LEFT, [0.95, 0.0, 0.05]]]])
    needed = torch.tensor([1, 1, 0, 2, 2])
    blind = find_blind(MOVES, torch.tensor(probs), torch.tensor(IDLE), needed)
    found = ResponseMap(
        height=np.array([0.0]),
        forward=np.array([5.0]),
        lateral=np.array([6.0, 3.0, 0.0, -3.0, -6.0]),
        probabilities=probs,
        without_target=np.array(IDLE),
        oracle=needed.numpy(),
        stratum=np.array([0, 0, 1, 2, 2]),
        blind=blind.numpy(),
    )
    # unnoticed; noticed; rightly ignored; noticed, though answered wrongly; hardly noticed
    assert found.blind.tolist() == [[[True, False, False, False, True]]]
    outcome = OutcomeMap(
        height=found.height,
        forward=found.forward,
        lateral=np.array([6.0, 0.0]),
        collected=np.array([[[False, True]]]),
        oracle=np.array([1, 0]),
        stratum=np.array([0, 1]),
    )
    rows = count_places(found, outcome)
    assert [(r.height, r.side, r.blind, r.collected, r.places) for r in rows] == [
        (0.0, "left", 0.5, 0, 1),
        (0.0, "ahead", 0.0, 1, 1),
        (0.0, "right", 0.5, 0, 0),
    ]


def test_a_turn_to_the_needed_side_is_not_blind():
    actions = ContinuousActions.of(SETTINGS)
    turns_left, turns_right = np.eye(5)[3], np.eye(5)[4]
    for probs, is_blind in ((turns_left, False), (turns_right, True)):
        probs = torch.tensor(probs).view(1, 1, 1, 5)
        assert find_blind(actions, probs, probs[0, 0, 0], torch.tensor([1])).item() is is_blind


def sides(bias):
    """A policy that compares the halves of a one-row picture, and prefers right by `bias`."""
    network = MLP((1, 1, 4), 3, hidden=())
    with torch.no_grad():
        network.layers.logits.weight.zero_()
        network.layers.logits.weight[Move.LEFT, :2] = 1.0
        network.layers.logits.weight[Move.RIGHT, 2:] = 1.0
        network.layers.logits.bias.copy_(torch.tensor([0.0, 0.0, bias]))
    return network


def test_asymmetry_of_frames_by_hand():
    rng = np.random.default_rng(0)
    x, bias = rng.normal(size=(10, 4)), 0.7
    left, right = x[:, :2].sum(1), x[:, 2:].sum(1)

    def odds(left, right):
        e = np.exp(np.stack([0 * left, left, right + bias], 1))
        return e / e.sum(1, keepdims=True)

    here, there = odds(left, right), odds(right, left)
    distance = 0.5 * np.abs(here - there[:, [0, 2, 1]]).sum(1)
    episode = np.arange(10) // 2
    observed = torch.tensor(x, dtype=torch.float32)[:, None, None]
    network = sides(bias)
    mirrored = probabilities(network, observed.flip(-1))
    found = asymmetry(probabilities(network, observed), mirrored, episode, MOVES)
    assert found.absolute.mean == pytest.approx(distance.mean(), abs=1e-5)
    assert found.signed.mean == pytest.approx((here[:, 1] - there[:, 2]).mean(), abs=1e-5)
    assert found.signed.lower95 < -0.5  # few episodes tell little, down to -1
    assert [one.frame for one in found.worst] == np.argsort(-distance)[:3].tolist()
    worst = [one.distance for one in found.worst]
    assert worst == pytest.approx(sorted(distance, reverse=True)[:3], abs=1e-5)


def test_the_asymmetry_of_the_map_is_between_a_place_and_its_mirror_image(context, monkeypatch):
    patch = functools.partial(monkeypatch.setitem, response.outcome_map.__kwdefaults__)
    patch("num_lateral", 3), patch("num_forward", 2)
    found = section(context)
    here = found.map.probabilities
    there = here[:, :, ::-1][..., [0, 2, 1]]
    assert found.asymmetry == pytest.approx(0.5 * np.abs(here - there).sum(-1).mean(), abs=1e-6)
