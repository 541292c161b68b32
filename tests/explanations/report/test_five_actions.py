"""Drones that turn, fly and hover: explained and reported without a word of three moves."""

import json

import pytest
import torch

from drone_rl.config import TaskSettings
from drone_rl.envs import DroneEnv, GrayPixels, StandardizePixels, with_transforms
from drone_rl.explanations.explain import explain_policy
from drone_rl.explanations.report import write_report
from drone_rl.explanations.settings import ExplainSettings
from drone_rl.policies import MLP
from tests.explanations.quick import ALL_SECTIONS, quick, quick_figures
from tests.second_dynamics import Turning


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """All sections but the verdict: the task's oracle does not know how to fly these drones."""
    folder = tmp_path_factory.mktemp("turning")
    env = with_transforms(
        DroneEnv(6, TaskSettings(num_cubes=1), dynamics=Turning()),
        [GrayPixels(), StandardizePixels()],
    )
    network = MLP((1, 25, 64), 5, hidden=(8,), generator=torch.Generator().manual_seed(0))
    network.actions = Turning.actions
    with torch.no_grad():  # mostly onwards, or flights last for ever
        network.layers.logits.bias.copy_(torch.tensor([3.0, 0.0, 0.0, -2.0, 0.0]))
    settings = ExplainSettings(frames=40, episodes=6, perplexity=5)
    sections = {name: s for name, s in ALL_SECTIONS.items() if name != "evaluation"}
    how = {"name": "turning", "provenance": {}, "sections": sections}
    with quick():
        explain_policy(env, network, folder, settings, **how)
    env.close()
    return folder


def test_the_explanation_says_what_its_actions_are(folder):
    numbers = json.loads((folder / "explanation.json").read_text())
    assert numbers["actions"]["names"] == list(Turning.actions.names)
    assert len(numbers["dataset"]["action_shares"]) == 5
    assert set(numbers["truth"]["curves"]["saliency"]) == set(Turning.actions.names)


def test_the_report_names_and_draws_all_five(folder, tmp_path):
    with quick_figures():
        page = write_report([folder], tmp_path).read_text()
    for name in Turning.actions.names:
        assert name in page, name
    assert page.count('rx=".2" fill="#000000"') == 5  # the legend of the map of frames
    table = next(tmp_path.rglob("*response*.csv")).read_text().splitlines()
    assert "p_turn left" in table[0] and len(table[1].split(",")) == 3 + 5 + 2
    assert all(row.split(",")[-2:] == ["", "0"] for row in table[1:])  # nobody knows what is needed
