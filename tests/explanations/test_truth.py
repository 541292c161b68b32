"""Effects of changes to a scene, and rollouts after them."""

import numpy as np
import pytest
import torch
from torch import nn

from drone_rl.config import BaseTaskSettings, CameraSettings
from drone_rl.envs import DroneEnv
from drone_rl.explanations.hooks import probabilities
from drone_rl.explanations.scenes import Region, Scenes, place_target
from drone_rl.explanations.truth import (
    PATIENCE,
    Intervention,
    TargetRollouts,
    clear_frame,
    followed,
    intervene,
    measure_outcomes,
    run_to_target,
    to_the_middle,
)
from drone_rl.policies import ImageNetwork
from drone_rl.sim.actions import Move


def test_only_what_was_changed_changes(scenes, world):
    state = place_target(scenes, torch.tensor([5.0, 8.0]), torch.tensor([2.0, -1.0]))
    regions, before = scenes.regions(state), scenes.frames(state)
    changes = {c.name: c for c in intervene(scenes, world[2], state, regions)}
    cube = regions == Region.NEXT_TARGET
    away = changes["target taken away"]
    empty = scenes.absent.expand(len(before), *scenes.absent.shape)
    torch.testing.assert_close(scenes.transform(away.frames), empty)
    for name in ("target recolored", "ground patch changed"):
        changed = (changes[name].frames != before).any(-1)
        assert torch.equal(changed, changes[name].area), name
    assert torch.equal(changes["target recolored"].area, cube)
    patch = changes["ground patch changed"].area
    assert patch.any() and (regions[patch] == Region.GROUND).all()
    moved = changes["target moved"]
    assert torch.equal((moved.frames != before).any(-1), moved.area)


def test_the_effect_is_the_distance_of_the_probabilities(scenes, world):
    network = world[2]
    state = place_target(scenes, torch.tensor([5.0, 8.0]), torch.tensor([2.0, -1.0]))
    changes = intervene(scenes, network, state, scenes.regions(state))
    before = probabilities(network, scenes.observe(state))
    for change in changes:
        after = probabilities(network, scenes.transform(change.frames))
        expected = 0.5 * (after - before).abs().sum(-1)
        np.testing.assert_allclose(change.effect, expected, atol=1e-6)
    assert changes[0].effect.min() > 1e-3


@pytest.mark.parametrize(
    ("lateral", "moved"), [(5.0, 3.0), (-5.0, -3.0), (0.5, 0.0), (-0.5, 0.0), (2.0, 0.0)]
)
def test_a_cube_is_moved_to_the_middle_and_never_away_from_it(scenes, lateral, moved):
    state = place_target(scenes, torch.tensor([9.0]), torch.tensor([lateral]))
    state.drone[:, 1] += 7.0
    state.places[..., 1] += 7.0
    after = to_the_middle(scenes, state)
    assert after.places[0, 0, 1].item() == pytest.approx(7.0 + moved)
    assert torch.equal(after.places[0, 1:], state.places[0, 1:])
    assert state.places[0, 0, 1] == 7.0 + lateral


class Follower(ImageNetwork):
    """Turns to where the picture differs from the empty scene, and flies on when in the middle."""

    def __init__(self, absent):
        super().__init__()
        self.absent = absent

    def forward(self, x):
        heat = (x - self.absent).abs().sum((1, 2))
        columns = torch.arange(x.shape[-1]) - (x.shape[-1] - 1) / 2
        middle = (heat * columns).sum(1) / heat.sum(1).clamp_min(1e-9)
        logits = torch.zeros(len(x), 3)
        logits[:, Move.LEFT], logits[:, Move.RIGHT] = -middle - 4, middle - 4
        return logits


class Always(ImageNetwork):
    """Takes one action."""

    def __init__(self, action):
        super().__init__()
        self.action = action

    def forward(self, x):
        return nn.functional.one_hot(torch.full((len(x),), int(self.action)), 3).float()


@pytest.fixture
def starts(scenes):
    return place_target(scenes, torch.full((12,), 9.0), torch.linspace(-3, 3, 12))


@pytest.fixture
def follower(scenes):
    return Follower(scenes.absent)


def test_a_policy_that_follows_the_target_reaches_it(scenes, starts, follower):
    found = measure_outcomes(scenes, follower, starts, np.arange(12))
    assert found.flights == 12
    assert found.collected["as it was"].mean > 0.8
    assert found.collected["moved left"].mean > 0.8
    assert found.follows.mean > 0.8
    assert found.collected["moved right"].mean > 0.8


@pytest.mark.parametrize("action", list(Move))
def test_a_constant_policy_follows_nothing(scenes, starts, action):
    found = measure_outcomes(scenes, Always(action), starts, np.arange(12))
    assert found.follows.mean == 0.0
    assert found.ground_changed.mean == 0.0
    assert found.ground_changed.upper95 < 0.5  # twelve rollouts show no more than that
    # straight on gets what stands ahead; moved by 2 m, half of that leaves the way
    if action is Move.FORWARD:
        ahead = (starts.places[:, 0, 1].abs() <= scenes.worlds.task.settings.touch_distance).float()
        assert found.collected["as it was"].mean == pytest.approx(float(ahead.mean()))
    else:
        assert found.collected["as it was"].mean < 0.5


def test_no_outcome_is_said_to_depend_on_ground_that_is_not_there():
    """A scene file has geoms alone."""
    task = BaseTaskSettings.read({"name": "reach", "scene": ["indoor"]}, "task")
    env = DroneEnv(3, task, camera=CameraSettings(width=24, height=12))
    env.reset()
    found = measure_outcomes(Scenes(env), Always(Move.FORWARD), env.worlds.state, np.arange(3))
    assert found.flights == 3
    assert found.ground_changed is None and found.finding is None


@pytest.mark.parametrize("fears_dark", [True, False])
def test_a_policy_that_responds_to_the_ground_has_another_outcome(scenes, starts, fears_dark):
    class Afraid(Always):
        def forward(self, x):
            dark = x[:, 0, -1, 0] < self.level  # the corner
            logits = super().forward(x)
            logits[dark == fears_dark] = torch.tensor([0.0, 1.0, 0.0])
            return logits

    network = Afraid(Move.FORWARD)
    network.level = float(scenes.observe(starts)[0, 0, -1, 0]) - 0.3
    ahead = place_target(scenes, torch.full((6,), 9.0), torch.zeros(6))
    found = measure_outcomes(scenes, network, ahead, np.arange(6))
    assert found.ground_changed.mean == 1.0
    assert found.collected["as it was"].mean == float(fears_dark)
    assert set(found.collected) == {"as it was", "moved left", "moved right"}


def test_rollouts_end_when_the_target_is_reached_or_passed(scenes):
    state = place_target(scenes, torch.tensor([5.0, 5.0]), torch.tensor([0.0, 4.0]))
    flown = run_to_target(scenes, Always(Move.FORWARD), state, state.ahead.long())
    # touched at 5 - 1.65, that is after four steps; passed after six
    assert (flown.collected.tolist(), flown.decided.tolist()) == ([True, False], [4, 6])
    assert flown.lateral.shape == (2, 7) and (flown.lateral == 0).all()
    dither = run_to_target(scenes, Always(Move.LEFT), state, state.ahead.long())
    assert (dither.decided < PATIENCE).all() and not dither.collected.any()  # out at the side


def rollout_of(decided, lateral):
    return TargetRollouts(np.array([True]), np.array([decided]), np.array([lateral]))


def test_following_by_hand():
    left, right = rollout_of(2, [0.0, 1.0, 2.0, 2.0]), rollout_of(3, [0.0, -1.0, -1.0, -3.0])
    assert followed(left, right).tolist() == [3.0 / 4.0]  # both after two steps
    assert followed(right, left).tolist() == [-3.0 / 4.0]
    assert followed(left, left).tolist() == [0.0]
    assert followed(rollout_of(1, [0.0, 9.0]), rollout_of(1, [0.0, 0.0])).tolist() == [1.0]


@pytest.mark.parametrize(
    ("effect", "covered", "shown"),
    [
        ([0.9, 0.8, 0.1], [90, 6, 5], 1),  # the target fills the first, the last shows no effect
        ([np.nan, 0.4, 0.5], [0, 20, 5], 2),
        ([0.0, 0.0, 0.0], [0, 50, 6], 2),
        ([np.nan, np.nan], [0, 0], 0),
    ],
)
def test_the_shown_frame_has_an_effect_and_a_small_target(effect, covered, shown):
    area = torch.zeros(len(covered), 10, 10, dtype=torch.bool)
    for mask, count in zip(area, covered, strict=True):
        mask.view(-1)[:count] = True
    change = Intervention("taken away", area, np.array(effect), torch.zeros(0))
    assert clear_frame(change) == shown
