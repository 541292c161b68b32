"""Explain, report, verdict and export as a user runs them, and one line for each mistake."""

import json

import pytest

from tests.cli.test_commands import drone_rl, error_line, in_process  # noqa: F401


@pytest.mark.slow
def test_explain_then_report(tmp_path):
    few = ["frames=60", "episodes=8", "perplexity=5", "num_envs=8"]
    done = drone_rl("explain", "policy=[good,poor]", *few, "hydra.run.dir=run", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "poor: poor" in done.stdout
    first = (tmp_path / "run" / "report.html").read_text()
    done = drone_rl("report", "explanations=run", "hydra.run.dir=again", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "again" / "report.html").read_text() == first
    refused = drone_rl(
        "explain", "policy=poor", "require=good", *few, "hydra.run.dir=no", cwd=tmp_path
    )
    assert refused.returncode == 13  # poor, but 8 episodes are too few to be certain


@pytest.mark.parametrize(
    ("policy", "status", "verdict"),
    [
        ("oracle", 0, "good"),
        ("random", 10, "poor"),
        ("forward", 10, "poor"),
        ("left", 10, "poor"),
        ("right", 10, "poor"),
        ("right_and_forward", 11, "one-sided (right)"),
    ],
)
def test_verdicts_are_exit_statuses(in_process, tmp_path, policy, status, verdict):  # noqa: F811
    done = in_process("verdict", f"policy={policy}", "episodes=300", "hydra.run.dir=v")
    assert done.returncode == status, done.stderr
    assert json.loads((tmp_path / "v" / "verdict.json").read_text())["kind"] == verdict
    assert done.stdout.startswith(verdict)


def test_an_export_can_be_judged(in_process, tmp_path):  # noqa: F811
    done = in_process("export", "policy=good", "name=mine", "episodes=20", "hydra.run.dir=e")
    assert done.returncode == 0, done.stderr
    assert "drone-rl train" in (tmp_path / "e" / "mine.md").read_text()
    done = in_process("verdict", "policy=e/mine.safetensors", "episodes=20", "hydra.run.dir=v")
    assert done.returncode == 13, done.stderr  # as good as can be, but 20 episodes prove nothing
    assert done.stdout.startswith("good (not certain): ")


@pytest.mark.parametrize(
    ("command", "told"),
    [
        (["explain", "policy=nobody"], ["nobody does not exist", "right_and_forward"]),
        (["explain", "policy=[]"], ["policy="]),
        (["explain", "policy=[good,good]"], ["each once"]),
        (["explain", "policy=good", "frames=3"], ["frames=3", "30 (data_episodes)"]),
        (["explain", "policy=good", "perplexity=500"], ["perplexity=500", "1 to 199"]),
        (["explain", "policy=good", "layer=conv9"], ["layer=conv9", "conv1, relu1"]),
        (["explain", "policy=good", "grad_cam_layer=fc1"], ["layer=fc1", "relu1, relu2"]),
        (["explain", "policy=good", "require=great"], ["require='great'", "good, poor"]),
        (["report"], ["explanations=latest", "drone-rl explain first"]),
        (["report", "explanations=nowhere"], ["nowhere", "explanation.json"]),
        (["verdict", "policy=good", "episodes=0"], ["episodes=0", "1 or more"]),
        (["verdict", "policy=good", "good_share=1"], ["good_share=1", "below 1"]),
        (["export", "policy=good", "episodes=0"], ["episodes=0", "1 or more"]),
    ],
)
def test_mistakes_get_one_line(in_process, command, told):  # noqa: F811
    line = error_line(in_process(*command))
    assert all(part in line for part in told), line
