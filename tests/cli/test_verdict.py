"""Verdicts are exit statuses."""

import json

import pytest

from tests.cli.running import error_line


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
def test_verdicts_are_exit_statuses(in_process, tmp_path, policy, status, verdict):
    done = in_process("verdict", f"policy={policy}", "episodes=300", "hydra.run.dir=v")
    assert done.returncode == status, done.stderr
    assert json.loads((tmp_path / "v" / "verdict.json").read_text())["kind"] == verdict
    assert done.stdout.startswith(verdict)


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (["verdict", "policy=good", "episodes=0"], ["episodes=0", "1 or more"]),
        (["verdict", "policy=good", "good_share=1"], ["good_share=1", "below 1"]),
    ],
)
def test_mistakes_get_one_line(in_process, command, words):
    line = error_line(in_process(*command))
    assert all(word in line for word in words), line
