"""Tests of heat maps, on a policy whose response is known."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from drone_rl.explanations import patches, trust
from drone_rl.explanations.heat_maps import Explainer
from drone_rl.explanations.hooks import of_input
from drone_rl.explanations.patches import PatchGrid, placebo_maps
from drone_rl.explanations.results import Likeness
from drone_rl.explanations.rollouts import spread_frames
from drone_rl.explanations.trust import (
    Trial,
    check_maps,
    check_method,
    method_maps,
)
from drone_rl.policies import MLP
from drone_rl.policies.networks import InputsNetwork

LEVEL = 0.01
SIZE = (8, 16)


def window_policy(window):
    """A linear policy that looks at a window alone."""
    network = MLP((1, *SIZE), 3, hidden=())
    weight = torch.zeros(3, *SIZE)
    weight[1][window], weight[2][window] = 0.5, -0.5
    with torch.no_grad():
        network.layers.logits.weight.copy_(weight.flatten(1))
    return network


def weights(network, x, a):
    """The true map of a linear policy."""
    found = network.layers.logits.weight.detach().abs().sum(0)
    return found.view(1, *SIZE).expand(len(x), -1, -1)


def make_trial(network, episodes=40, frames=3, seed=0, rest=None):
    generator = torch.Generator().manual_seed(seed)
    x = torch.randn(episodes * frames, 1, *SIZE, generator=generator)
    others = [torch.randn(x.shape, generator=generator) for _ in range(2)]
    grid = PatchGrid(2, 4, 4, 4)
    return Trial(
        network=network,
        observations=x,
        actions=torch.arange(len(x)) % 3,
        effects=patches.patch_effects(network, x, others, grid, rest),
        placebos=placebo_maps(x, torch.zeros(1, *SIZE), others),
        rest=rest,
        episode=np.arange(len(x)) // frames,
        grid=grid,
    )


@pytest.fixture(scope="module")
def trial():
    return make_trial(window_policy((slice(2, 6), slice(8, 16))))


def test_the_true_map_is_trusted(trial):
    found = check_maps(trial, {"true": weights}, num_methods=5)
    method = found.methods["true"]
    assert found.trusted == "true" and method.failed == ()
    assert method.score.mean > 0.7
    # of the window's four patches, which are equally hot, two are the tenth that moves it most
    assert (method.pointing.hit, method.pointing.chance) == (0.5, 2 / 16)
    assert found.level == LEVEL and found.confidence == 0.98
    assert (found.frames, found.episodes) == (120, 40)
    assert found.placebos["ones"].mean == 0.0


def test_other_inputs_keep_each_frames_values():
    window = window_policy((slice(2, 6), slice(8, 16)))
    network = InputsNetwork({"image": (1, *SIZE), "goal": (3,)}, {"image": window}, 3, hidden=())
    with torch.no_grad():  # the goal decides in every second frame, and the window in the others
        network.branches.vectors[0].weight.copy_(torch.eye(64, 3))
        network.branches.vectors[0].bias.zero_()
        seen, told = window.layers.logits.weight, torch.eye(3, 64)
        network.layers.logits.weight.copy_(torch.cat([seen, told], 1))
    goal = torch.zeros(120, 3)
    goal[::2, 0] = 100.0
    view = of_input(network, "image")
    trial = make_trial(view, rest=goal)
    assert (trial.effects[::2] < 1e-6).all() and (trial.effects[1::2].max(1) > 0.01).all()
    deciding = trial[np.arange(1, 120, 2)]
    np.testing.assert_allclose(deciding.effects, make_trial(window).effects[1::2], atol=1e-6)

    def true_map(network, x, a, rest):
        found = network.network.layers.logits.weight[:, : 8 * 16].detach().abs().sum(0)
        return found.view(1, *SIZE).expand(len(x), -1, -1)

    assert check_maps(deciding, {"true": true_map}, num_methods=5).trusted == "true"


@pytest.mark.parametrize(
    ("upper", "seeds", "failed"),
    [
        (0.49, (-0.9, 0.49), ()),
        (0.49, (-0.9, 0.5), ("likeness",)),  # with some weights it is alike
        (0.5, (0.1, 0.2), ("likeness",)),
        (None, (0.1, 0.2), ("likeness",)),  # too few episodes
    ],
)
def test_likeness_to_shuffled_weights_has_a_limit(trial, monkeypatch, upper, seeds, failed):
    likeness = Likeness(median=0.0, lower=None, upper=upper, seeds=seeds)
    monkeypatch.setattr(trust, "_likeness", lambda *args: likeness)
    assert check_method(trial, weights, 0.2).failed == failed


def test_placebos_are_not_trusted(trial):
    methods = {name: lambda n, x, a, m=maps: m for name, maps in trial.placebos.items()}
    found = check_maps(
        trial, {k: (lambda n, x, a, m=m: m(n, x, a)[: len(x)]) for k, m in methods.items()}
    )
    assert found.trusted is None
    for name, method in found.methods.items():
        assert {"placebos", "likeness"} <= set(method.failed), name


def test_a_correct_map_that_ignores_the_policy_is_not_trusted(trial):
    true = weights(trial.network, trial.observations, None)
    found = check_method(trial, lambda n, x, a: true[: len(x)], LEVEL)
    assert found.failed == ("likeness",)
    assert found.likeness.median == 1.0


def test_noise_that_depends_on_the_weights_is_not_trusted(trial):
    true = weights(trial.network, trial.observations, None)

    def adversarial(network, x, a):
        seed = int(network.layers.logits.weight.double().cumsum(1).sum() * 1e6) % 2**31
        noise = torch.rand(SIZE, generator=torch.Generator().manual_seed(seed))
        return true[: len(x)] * (0.5 + noise)

    found = check_method(trial, adversarial, LEVEL)
    assert found.failed == ("random weights",)


def test_a_map_without_heat_is_not_trusted(trial):
    found = check_method(trial, lambda n, x, a: torch.zeros(len(x), *SIZE), LEVEL)
    assert {"placebos", "pointing", "likeness"} == set(found.failed)


def test_few_episodes_decide_nothing():
    found = check_method(make_trial(window_policy((slice(2, 4), slice(4, 8))), 5), weights, LEVEL)
    assert not found.trusted and found.pointing.lower is None


def test_nothing_is_trusted_for_a_constant_policy(trial):
    blind = trial[np.zeros(0, np.int64)]
    found = check_maps(dataclasses.replace(blind, frames_without_effect=120), {"true": weights})
    assert found.trusted is None and found.frames_unmoved == 120
    assert found.methods["true"].failed == ("nothing moves the policy",)


def test_methods_use_the_network_of_the_call(trial):
    methods = method_maps(Explainer(trial.network, torch.zeros(1, *SIZE)))
    assert set(methods) == {"saliency", "integrated_gradients", "occlusion"}
    other = window_policy((slice(0, 2), slice(0, 4)))
    x, a = trial.observations[:4], trial.actions[:4]
    for name in ("saliency", "occlusion"):
        there = methods[name](other, x, a).mean(0)
        assert there[0, 0] > 0 and there[3, 10] < 1e-6, name
        assert methods[name](trial.network, x, a).mean(0)[3, 10] > 0, name


def test_a_trial_of_a_policy_in_the_simulator(world, scenes, dataset):
    seed = SimpleNamespace(value=0)
    context = SimpleNamespace(dataset=dataset, scenes=scenes, network=world[2], seed=seed)
    made = trust.make_trial(context)
    assert made.effects.shape == (len(made.episode), 40) == (len(made.observations), 40)
    rows = spread_frames(dataset.episode, trust.FRAMES_AN_EPISODE)
    assert len(made.episode) + made.frames_without_effect == len(rows)
    torch.testing.assert_close(
        made.observations, dataset.tensor("observations")[rows][: len(made.episode)]
    )
    assert "mean difference to re-rendered patches" in made.placebos
    with torch.no_grad():
        world[2].layers.logits.weight.zero_()
    blind = trust.make_trial(context)
    assert len(blind.episode) == 0 and blind.frames_without_effect == len(rows)
    found = check_maps(blind, method_maps(Explainer(world[2], torch.zeros(1, 25, 64))))
    assert found.trusted is None
