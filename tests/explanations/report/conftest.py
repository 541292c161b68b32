"""Explanations of a small untrained policy, made once."""

import json
import shutil

import pytest
import torch

from drone_rl.envs import DroneEnv, GrayPixels, StandardizePixels, with_transforms
from drone_rl.explanations.settings import ExplainSettings
from drone_rl.explanations.study import explain_policy
from drone_rl.policies import SmallCNN

NASTY = '</script><b>"a" & b'
"""A name that would break a page that didn't escape it."""


@pytest.fixture(scope="session")
def explanations(tmp_path_factory):
    """Two folders; the second is the first under another name."""
    root = tmp_path_factory.mktemp("explanations")
    env = with_transforms(DroneEnv(30), [GrayPixels(), StandardizePixels()])
    generator = torch.Generator().manual_seed(0)
    network = SmallCNN((1, 25, 64), 3, channels=(4,), hidden=(8,), generator=generator)
    settings = ExplainSettings(frames=180, episodes=6, perplexity=5)
    origin = {"policy": f"/somewhere/{NASTY}", "trained": {}}
    explain_policy(env, network, root / "a", settings, name=NASTY, provenance=origin)
    env.close()
    shutil.copytree(root / "a", root / "b")
    numbers = json.loads((root / "b" / "explanation.json").read_text())
    (root / "b" / "explanation.json").write_text(json.dumps({**numbers, "name": "second"}))
    return [root / "a", root / "b"]
