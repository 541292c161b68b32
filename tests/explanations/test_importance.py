"""Importance of inputs, on a policy with known weights."""

import numpy as np
import pytest
import torch

from drone_rl.config import TaskSettings
from drone_rl.config.camera import CameraSettings
from drone_rl.config.inputs import Altitude, DepthImage, GrayImage, describe_inputs
from drone_rl.envs import DroneEnv
from drone_rl.explanations.context import Context, find_lacking
from drone_rl.explanations.explain import SECTIONS
from drone_rl.explanations.importance import compare, other_frames, section
from drone_rl.explanations.settings import ExplainSettings
from drone_rl.policies import SmallCNN
from drone_rl.policies.networks import InputsNetwork

SETTINGS = ExplainSettings(frames=60, perplexity=5, seed=3)
SHAPES = {"gray": (1, 25, 64), "depth": (1, 25, 64), "altitude": (1,), "placebo": (1,)}
INPUTS = {
    "gray": GrayImage(),
    "depth": DepthImage(),
    "altitude": Altitude(),
    "placebo": Altitude(noise=5.0),  # nothing but random numbers, since the altitude is constant
}


def context_of(**weights):
    """A policy of these inputs; of vectors, the weight is that of left minus right."""
    names = [*weights]
    env = DroneEnv(
        30,
        TaskSettings(num_cubes=1),
        inputs=describe_inputs({n: INPUTS[n] for n in names}, CameraSettings(), ()),
        seed=5,
    )
    generator = torch.Generator().manual_seed(0)
    shapes = {name: SHAPES[name] for name in names}
    images = {
        n: SmallCNN(s, 3, channels=(4,), generator=generator)
        for n, s in shapes.items()
        if len(s) == 3
    }
    network = InputsNetwork(shapes, images, 3, hidden=(), generator=generator)
    vectors = [name for name in names if name not in images]
    width = network.layers.logits.in_features
    with torch.no_grad():
        first, last = network.branches["vectors"][0], network.layers.logits
        first.weight.zero_(), last.bias.zero_(), last.weight[:, width - 64 :].zero_()
        for i, name in enumerate(vectors):  # one feature for each sign
            first.weight[2 * i, i], first.weight[2 * i + 1, i] = 1.0, -1.0
            last.weight[1, width - 64 + 2 * i] = weights[name]
            last.weight[2, width - 64 + 2 * i + 1] = weights[name]
        seen = last.weight[:, : width - 64]
        seen.sub_(seen.mean(1, keepdim=True)).mul_(weights.get("gray", 0.0))
    return Context(env, network, SETTINGS)


def test_images_matter_and_random_numbers_do_not():
    found = section(context_of(gray=300.0, altitude=1.0, placebo=3.0)).inputs
    assert found["gray"].matters and found["gray"].placebo.median == 0.0
    assert not found["altitude"].matters and found["altitude"].effect.upper == 0.0
    placebo = found["placebo"]
    assert placebo.effect.lower > 0.1 and not placebo.matters
    assert placebo.placebo.median == pytest.approx(placebo.effect.median, abs=0.05)


def test_the_excess_is_a_median_of_episodes():
    episode = np.arange(40) // 2
    effect = np.where(np.arange(40) % 2, 0.5, 0.1)  # 0.3 in each episode
    found = compare(effect, np.full(40, 0.1), episode)
    assert (found.excess.median, found.excess.lower) == pytest.approx((0.2, 0.2))
    assert found.matters and found.effect.median == pytest.approx(0.3)
    assert not compare(effect, effect - 0.005, episode).matters  # too little
    assert not compare(effect[:8], np.zeros(8), episode[:8]).matters  # too few episodes


def test_other_frames_are_those_of_other_episodes():
    episode = np.array([0, 0, 1, 1, 1, 2])
    others = other_frames(episode, np.random.default_rng(0))
    assert (episode[others] != episode).all()
    assert other_frames(np.zeros(2, int), np.random.default_rng(0)).tolist() == [0, 1]


def test_one_input_has_no_importance(context):
    assert section(context) is None


def test_without_images_maps_are_left_out():
    context = context_of(altitude=1.0, placebo=3.0)
    lacking = find_lacking(SECTIONS, context)
    why = "The policy sees no image, only altitude and placebo."
    assert {name for name, reason in lacking.items() if reason == why} == {
        *("attribution", "class_model", "tsne", "truth")
    }
    rest = {n: s for n, s in SECTIONS.items() if n in ("dataset", "flaws", "response", "asymmetry")}
    assert all(one(context) is not None for one in rest.values())


@pytest.mark.parametrize("name", ["gray", "depth"])
def test_maps_are_those_of_one_image(name):
    whole = context_of(gray=300.0, depth=300.0, placebo=3.0)
    context = Context(whole.env, whole.network.network, SETTINGS, observations=name)
    data = context.dataset
    assert context.explainer.layer == f"branches.{name}.relu1"
    inputs = {name: data.tensor("observations"), **data.others}
    with torch.no_grad():
        logits = whole.network.network(*(inputs[key] for key in SHAPES if key in inputs))
    torch.testing.assert_close(data.tensor("probabilities"), logits.softmax(-1))
    steps = data.tensor("observations")[:5], data.tensor("actions")[:5], data.rest[:5]
    for one, method in context.explainer.methods().items():
        heat = method(*steps)
        assert heat.shape == (5, 25, 64) and (heat > 0).any(), one
    assert not torch.equal(method(steps[0], steps[1], data.rest[5:10]), heat)
