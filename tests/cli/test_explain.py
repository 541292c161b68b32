"""Explanations as a user asks for them; their report, made again."""

import pytest

from tests.cli.running import drone_rl, error_line


@pytest.mark.slow
def test_explain_then_report(tmp_path):
    few = ["frames=60", "episodes=8", "perplexity=5", "num_envs=32"]
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
    ("command", "words"),
    [
        (["explain", "policy=nobody"], ["nobody does not exist", "right_and_forward"]),
        (["explain", "policy=[]"], ["policy="]),
        (["explain", "policy=[good,good]"], ["each once"]),
        (["explain", "policy=good", "frames=3"], ["frames=3", "30 (data_episodes)"]),
        (["explain", "policy=good", "perplexity=500"], ["perplexity=500", "1 to 199"]),
        (["explain", "policy=good", "layer=conv9"], ["layer=conv9", "conv1, relu1"]),
        (["explain", "policy=good", "grad_cam_layer=fc1"], ["layer=fc1", "relu1, relu2"]),
        (
            ["explain", "policy=good", "require=great"],
            ["require='great'", "good, good, but trivial, poor"],
        ),
    ],
)
def test_mistakes_get_one_line(in_process, command, words):
    line = error_line(in_process(*command))
    assert all(word in line for word in words), line
