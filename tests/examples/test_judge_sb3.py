"""Runs the example in a short version."""

import functools
from pathlib import Path

import pytest

import drone_rl
from tests.explanations.quick import few_sections, quick_figures

sb3 = pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is not installed")
SHORT = {"num_cubes": 1, "first_distance": 6.0, "step_limit": 40}
PATH = Path(__file__).parents[2] / "examples" / "judge_sb3.py"


@pytest.mark.slow
def test_train_save_judge_and_explain(example, tmp_path, capsys, monkeypatch):
    short = functools.partial(drone_rl.policy_from, task=drone_rl.TaskSettings(**SHORT))
    monkeypatch.setattr(drone_rl, "policy_from", short)
    example.train(512, num_envs=32, steps=16).save(tmp_path / "ppo.zip")
    model = sb3.PPO.load(tmp_path / "ppo.zip")
    few = few_sections("attribution", "dataset", "verdict")
    with few, quick_figures():
        example.trust(model, str(tmp_path), frames=30, episodes=6, perplexity=5)
    verdict, *_, report = capsys.readouterr().out.splitlines()
    assert "episodes are too few to be certain" in verdict
    page = Path(report).read_text()
    assert (
        "of layer policy.features_extractor.cnn.5" in page
    )  # the nonlinearity after the last convolution
