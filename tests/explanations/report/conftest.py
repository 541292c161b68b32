"""Explanations of a small untrained policy, computed once."""

import json
import shutil

import pytest
import torch

from drone_rl.envs import DroneEnv, GrayPixels, StandardizePixels
from drone_rl.explanations.context import Context
from drone_rl.explanations.explain import explain_policy
from drone_rl.explanations.report import write_report
from drone_rl.explanations.settings import ExplainSettings
from drone_rl.policies import SmallCNN
from tests.explanations.quick import ALL_SECTIONS, quick, quick_figures
from tests.shared import shared_folder

NASTY = '</script><b>"a" & b'
"""A name that would break a page that didn't escape it."""


@pytest.fixture(scope="session")
def explanations(tmp_path_factory):
    """Two folders; the second is the first under another name."""
    root = shared_folder(tmp_path_factory, "explanations", explain_twice)
    return [root / "a", root / "b"]


@pytest.fixture(scope="session")
def report(explanations, tmp_path_factory):
    """The page of both; other files of the report are next to it."""

    def make(folder):
        with quick_figures():
            write_report(explanations, folder)

    return shared_folder(tmp_path_factory, "report", make) / "report.html"


def explain_twice(root):
    env = DroneEnv(30, transforms=[GrayPixels(), StandardizePixels()])
    generator = torch.Generator().manual_seed(0)
    network = SmallCNN((1, 25, 64), 3, channels=(4,), hidden=(8,), generator=generator)
    settings = ExplainSettings(frames=90, episodes=6, perplexity=5)
    origin = {"policy": f"/somewhere/{NASTY}", "trained": {}}
    with quick():
        context, path = Context(env, network, settings), root / "a"
        explain_policy(context, path, name=NASTY, provenance=origin, sections=ALL_SECTIONS)
    env.close()
    shutil.copytree(root / "a", root / "b")
    numbers = json.loads((root / "b" / "explanation.json").read_text())
    (root / "b" / "explanation.json").write_text(json.dumps({**numbers, "name": "second"}))
