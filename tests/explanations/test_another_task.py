"""Explanations of a task, a motion and a set of actions that are none of the chapter's."""

import numpy as np
import pytest
import torch

from drone_rl.envs import DroneEnv, GrayPixels, StandardizePixels, with_transforms
from drone_rl.explanations.context import Context
from drone_rl.explanations.explain import explain_policy
from drone_rl.explanations.settings import ExplainSettings
from drone_rl.policies import MLP
from tests.explanations.quick import quick
from tests.second_task import NUM_POSTS, Posts


@pytest.fixture
def context():
    env = with_transforms(DroneEnv(6, Posts(), seed=2), [GrayPixels(), StandardizePixels()])
    generator = torch.Generator().manual_seed(0)
    network = MLP((1, 25, 64), 3, hidden=(8,), generator=generator)
    with torch.no_grad():  # mostly forward, or no post is ever passed
        network.layers.logits.bias.copy_(torch.tensor([2.0, 0.0, 0.0]))
    yield Context(env, network, ExplainSettings(frames=40, episodes=12, perplexity=5))
    env.close()


def test_flights_are_recorded_as_the_task_remembers_them(context):
    data = context.dataset
    assert {"posts", "next_target"} < set(data.arrays) and "cubes" not in data.arrays
    state = data.state(context.scenes.task)
    again = context.scenes.frames(state).numpy()
    np.testing.assert_array_equal(again, data.frames)  # the recalled worlds look as they did
    assert data.offset(context.scenes.task).shape == (40, 2)
    assert data.next_target.max() <= NUM_POSTS


def test_all_sections_are_made(context, tmp_path):
    """Nothing of an explanation needs cubes, only targets."""
    with quick():
        numbers = explain_policy(
            context.env, context.network, tmp_path, context.settings, name="posts", provenance={}
        )
    assert numbers["verdict"]["num_cubes"] == NUM_POSTS
    assert [row["side"] for row in numbers["response"]["rows"]] == ["left", "right"]
    assert set(numbers["truth"]["outcomes"]["collected"]) == {
        "as it was", "moved left", "moved right",
    }  # fmt: skip
    assert list(numbers["truth"]["curves"]["saliency"]) == ["forward", "left", "right"]
