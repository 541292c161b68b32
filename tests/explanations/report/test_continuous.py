"""Drones told how fast to fly: judged, explained and reported like those that choose moves."""

import json

import numpy as np
import pytest
import torch

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
        explain_policy(env, network, folder, settings, name="fast", provenance={})
    env.close()
    return folder


def test_the_explanation_says_what_actions_are_for_the_most_part(folder):
    numbers = json.loads((folder / "explanation.json").read_text())
    assert numbers["actions"]["names"] == NAMES
    assert len(numbers["dataset"]["action_shares"]) == 5
    assert set(numbers["truth"]["curves"]["saliency"]) == set(NAMES)
    assert numbers["asymmetry"]["dataset"]["absolute"]["mean"] > 0
    assert numbers["verdict"]["baselines"]["oracle"]["success"]["share"] == 1.0


def test_the_data_say_what_was_asked_for_in_units(folder):
    with np.load(next(folder.rglob("*.npz"))) as data:
        fields = json.loads(str(data["meta"]))["fields"]
        rates, parts = data["rates"], data["actions"]
    assert "m/s" in fields["rates"] and "turn left" in fields["actions"]
    assert rates.shape == (40, 3) and rates[:, 0].min() >= 0 and rates.max() <= 4.0
    assert set(parts.tolist()) <= set(range(5))


def test_the_report_names_and_draws_the_parts(folder, tmp_path):
    with quick_figures():
        page = write_report([folder], tmp_path).read_text()
    for name in NAMES:
        assert name in page, name
    assert "if that is above a third of the maximum" in page
    assert 'turn left</th><th scope="col">turn right</th><th scope="col">roughness</th>' in page
    assert "The first 5 maps" in page
    table = next(tmp_path.rglob("*response*.csv")).read_text().splitlines()
    assert "p_turn left" in table[0]
