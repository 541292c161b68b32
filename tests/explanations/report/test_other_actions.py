"""A policy with continuous actions: explained and reported by the names of its actions."""

import json

import numpy as np
import pytest
import torch

from drone_rl.explanations.context import Context
from drone_rl.explanations.explain import explain_policy
from drone_rl.explanations.report import write_report
from drone_rl.explanations.settings import ExplainSettings
from tests.continuous import make_env, make_policy
from tests.explanations.quick import quick, quick_figures

NAMES = ["forward", "left", "right", "turn left", "turn right"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """All sections, the verdict among them."""
    folder = tmp_path_factory.mktemp("continuous")
    env = make_env(6)
    network, _ = make_policy(env)
    with torch.no_grad():  # mostly onwards, a little to the left
        network.layers.logits.weight.mul_(20)
        network.layers.logits.bias.copy_(torch.tensor([1.0, 0.2, 0.0, 0.0, 0.0, 0.0]))
    settings = ExplainSettings(frames=40, episodes=6, perplexity=5)
    with quick():
        context = Context(env, network, settings)
        explain_policy(context, folder, name="fast", provenance={})
    env.close()
    return folder


def test_numbers_are_by_the_names_of_the_actions(folder):
    numbers = json.loads((folder / "explanation.json").read_text())
    assert numbers["actions"]["names"] == NAMES
    assert len(numbers["dataset"]["action_shares"]) == 5
    with np.load(folder / "dataset.npz") as data:
        rates, parts = data["rates"], data["actions"]
    assert rates.shape == (40, 3) and rates[:, 0].min() >= 0 and rates.max() <= 4.0
    assert set(parts.tolist()) <= set(range(5))


def test_the_report_names_all_actions(folder, tmp_path):
    with quick_figures():
        page = write_report([folder], tmp_path).read_text()
    assert all(name in page for name in NAMES)
    assert "P(turn left)" in page
