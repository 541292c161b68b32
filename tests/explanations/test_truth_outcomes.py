import dataclasses

import numpy as np
import pytest
import torch
from torch import nn

from drone_rl.explanations.scenes import empty_scene, place_target
from drone_rl.explanations.truth import (
    PATIENCE,
    TargetRollouts,
    followed,
    measure_outcomes,
    run_to_target,
)
from drone_rl.sim.actions import Move


class Follower(nn.Module):
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


class Always(nn.Module):
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
    return Follower(scenes.observe(empty_scene(scenes))[0])


def test_a_policy_that_looks_follows_the_cube_and_gets_it(scenes, starts, follower):
    found = measure_outcomes(scenes, follower, starts, np.arange(12))
    assert found["flights"] == 12
    assert found["collected"]["as it was"]["mean"] > 0.8
    assert found["collected"]["moved left"]["mean"] > 0.8
    assert found["follows"]["mean"] > 0.8
    assert found["collected"]["moved right"]["mean"] > 0.8


@pytest.mark.parametrize("action", list(Move))
def test_a_policy_that_does_not_look_follows_nothing(scenes, starts, action):
    found = measure_outcomes(scenes, Always(action), starts, np.arange(12))
    assert found["follows"]["mean"] == 0.0
    assert found["ground_changed"]["mean"] == 0.0
    assert found["ground_changed"]["upper95"] < 0.5  # twelve flights show no more than that
    # straight on gets what stands ahead; moved by 2 m, half of that leaves the way
    if action is Move.FORWARD:
        ahead = (starts.cubes[:, 0, 1].abs() <= scenes.worlds.task.settings.touch_distance).float()
        assert found["collected"]["as it was"]["mean"] == pytest.approx(float(ahead.mean()))
    else:
        assert found["collected"]["as it was"]["mean"] < 0.5


@pytest.mark.parametrize("fears_dark", [True, False])
def test_a_policy_that_minds_the_ground_gets_another_outcome(scenes, starts, fears_dark):
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
    assert found["ground_changed"]["mean"] == 1.0
    assert found["collected"]["as it was"]["mean"] == float(fears_dark)
    assert set(found["collected"]) == {"as it was", "moved left", "moved right"}


def test_flights_end_when_the_cube_is_decided(scenes):
    state = place_target(scenes, torch.tensor([5.0, 5.0]), torch.tensor([0.0, 4.0]))
    flown = run_to_target(scenes, Always(Move.FORWARD), state, state.next_cube)
    # touched at 5 - 1.65, that is after four steps; passed after six
    assert (flown.collected.tolist(), flown.decided.tolist()) == ([True, False], [4, 6])
    assert flown.lateral.shape == (2, 7) and (flown.lateral == 0).all()
    dither = run_to_target(scenes, Always(Move.LEFT), state, state.next_cube)
    assert (dither.decided < PATIENCE).all() and not dither.collected.any()  # out at the side


def test_patience_ends(scenes, monkeypatch):
    monkeypatch.setattr("drone_rl.explanations.truth.PATIENCE", 3)
    state = place_target(scenes, torch.tensor([9.0]), torch.tensor([0.0]))
    flown = run_to_target(scenes, Always(Move.FORWARD), state, state.next_cube)
    assert (flown.collected.tolist(), flown.decided.tolist()) == ([False], [3])


def test_no_flights_have_no_steps(scenes):
    state = empty_scene(scenes)[torch.arange(0)]
    flown = run_to_target(scenes, Always(Move.FORWARD), state, state.next_cube)
    assert flown.lateral.shape == (0, 1)
    assert (len(flown.collected), len(flown.decided)) == (0, 0)


def flights(decided, lateral):
    return TargetRollouts(np.array([True]), np.array([decided]), np.array([lateral]))


def test_flights_are_facts():
    with pytest.raises(dataclasses.FrozenInstanceError):
        flights(1, [0.0, 1.0]).decided = 0


def test_following_by_hand():
    left, right = flights(2, [0.0, 1.0, 2.0, 2.0]), flights(3, [0.0, -1.0, -1.0, -3.0])
    assert followed(left, right).tolist() == [3.0 / 4.0]  # both after two steps
    assert followed(right, left).tolist() == [-3.0 / 4.0]
    assert followed(left, left).tolist() == [0.0]
    assert followed(flights(1, [0.0, 9.0]), flights(1, [0.0, 0.0])).tolist() == [1.0]


def test_without_a_cube_nothing_flies(scenes, follower):
    found = measure_outcomes(scenes, follower, empty_scene(scenes), np.zeros(1))
    assert found["flights"] == 0 and found["follows"]["mean"] is None
