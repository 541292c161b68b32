import math

import pytest
import torch
from tensordict import TensorDict
from torch import nn
from torchrl.data import Bounded, Categorical
from torchrl.envs.utils import ExplorationType, set_exploration_type
from torchrl.modules import ProbabilisticActor

from drone_rl.policies import make_actor
from drone_rl.policies.actor import (
    exploring,
)


class Fixed(nn.Module):
    def forward(self, pixels):
        return torch.tensor([0.1, 0.7, 0.2]).log().expand(len(pixels), 3)


def act(actor, n=20_000):
    return actor(TensorDict({"pixels": torch.zeros(n, 1)}, [n]))["action"]


def build(seed=0):
    return make_actor(Fixed(), Categorical(3), torch.Generator().manual_seed(seed))


def test_samples_by_the_probabilities_by_default():
    shares = torch.bincount(act(build()), minlength=3) / 20_000
    expected = torch.tensor([0.1, 0.7, 0.2])
    deviation = (expected * (1 - expected) / 20_000).sqrt()
    assert ((shares - expected).abs() < 4 * deviation).all()


@pytest.mark.parametrize("how", [ExplorationType.RANDOM, ExplorationType.DETERMINISTIC])
def test_fast_path_equals_torchrls_actor(how):
    pixels = TensorDict({"pixels": torch.zeros(500, 1)}, [500])
    fast_actor, around = build(3), build(3)
    with set_exploration_type(how):
        one, two = fast_actor(pixels.clone()), ProbabilisticActor.forward(around, pixels.clone())
    assert set(one.keys()) == set(two.keys()) == {"pixels", "logits", "action"}
    assert all(torch.equal(one[key], two[key]) for key in ("logits", "action"))


def test_other_exploration_types_use_torchrls_actor():
    with set_exploration_type(ExplorationType.MODE):
        assert (act(build(), n=3) == 1).all()
    assert build()(pixels=torch.zeros(2, 1))[1].shape == (2,)  # logits, action


def test_samples_use_only_the_own_generator():
    torch.manual_seed(0)
    before = torch.get_rng_state()
    first = act(build(1))
    assert torch.equal(torch.get_rng_state(), before)
    assert torch.equal(first, act(build(1)))
    assert not torch.equal(first, act(build(2)))


@pytest.mark.parametrize("outer", [None, *ExplorationType])
def test_an_action_can_be_chosen_whatever_the_exploration_type_is(outer):
    pixels = TensorDict({"pixels": torch.zeros(500, 1)}, [500])
    expected = build(3)(pixels.clone())
    with set_exploration_type(outer):
        with exploring(greedy=False):
            drawn = build(3)(pixels.clone())
        with exploring(greedy=True):
            greedy = build(3)(pixels.clone())
    assert set(drawn.keys()) == set(expected.keys())
    assert all(torch.equal(drawn[key], expected[key]) for key in ("logits", "action"))
    assert (greedy["action"] == 1).all()


class Leaning(nn.Module):
    """A network with means 0, 1 and -1 and deviation exp(-0.5)."""

    def forward(self, pixels):
        outputs = torch.tensor([0.0, *(sign * 3 * math.atanh(1 / 3) for sign in (1, -1)), 0, 0, 0])
        return outputs.expand(len(pixels), 6)


def lean(seed=0):
    spec = Bounded(-1, 1, (3,), dtype=torch.float32)
    return make_actor(Leaning(), spec, torch.Generator().manual_seed(seed))


def test_continuous_actions_are_sampled_from_squashed_normals():
    drawn = act(lean())
    assert drawn.shape == (20_000, 3) and drawn.dtype == torch.float32
    normal = drawn.double().atanh()
    expected = torch.tensor([0.0, 1.0, -1.0], dtype=torch.float64)
    assert (normal.mean(0) - expected).abs().max() < 4 * math.exp(-0.5) / 20_000**0.5
    assert (normal.std(0) - math.exp(-0.5)).abs().max() < 0.02
    with set_exploration_type(ExplorationType.DETERMINISTIC):
        torch.testing.assert_close(act(lean(), 2)[1].double(), expected.tanh(), atol=1e-6, rtol=0)
