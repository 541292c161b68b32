"""Commands end with what a user may do next, in a terminal."""

import re
import shutil
import sys
from pathlib import Path

import pytest

from drone_rl.cli.commands import TABLE
from drone_rl.cli.hydra.composition import register_schemas
from drone_rl.cli.hydra.help import next_steps
from drone_rl.cli.hydra.names import composed
from drone_rl.cli.main import find_command
from drone_rl.utils.settings import conf_dir


def test_the_policy_and_the_next_commands():
    assert next_steps("verdict", "my run", Path("x")).splitlines() == [
        "policy: my run",
        "next:",
        "  drone-rl explain policy='my run'",
        "  drone-rl shifts policy='my run'",
        "  drone-rl prove policy='my run'",
    ]
    assert next_steps("bench", "latest", Path("x")) == ""


@pytest.mark.parametrize("name", TABLE)
def test_next_commands_exist_with_these_settings(name, tmp_path):
    assert len(TABLE[name]["next"]) <= 3
    for file in re.findall(r"\{folder\}/([\w.]+)", " ".join(TABLE[name]["next"])):
        (tmp_path / file).touch()
    lines = next_steps(name, "good", tmp_path).splitlines()
    assert sum(line.startswith("  drone-rl") for line in lines) == len(TABLE[name]["next"])
    for line in lines:
        if line.startswith("  drone-rl"):
            command, *words = line.split()[1:]
            register_schemas(**{command: find_command(command)})
            composed(command, conf_dir(), words)


def test_they_are_for_terminals_alone(run, in_process, monkeypatch, tmp_path):
    command = ["verdict", f"policy={run}", "episodes=2", "sampled=false", "num_envs=2"]
    assert "next:" not in in_process(*command).stdout
    monkeypatch.setattr(type(sys.stdout), "isatty", lambda self: True)
    printed = in_process(*command).stdout
    assert f"policy: {run}\nnext:\n  drone-rl explain policy={run}" in printed


def test_files_that_were_not_written_are_not_suggested(tmp_path):
    assert "domain.yaml" not in next_steps("shifts", "good", tmp_path)
    assert "next:" not in next_steps("export", "good", tmp_path)
    (tmp_path / "policy.safetensors").touch()
    assert "policy.safetensors" in next_steps("export", "good", tmp_path)


def test_the_policy_that_was_used_is_named(run, in_process, monkeypatch, tmp_path):
    runs = tmp_path / "outputs" / "train" / "runs"
    shutil.copytree(run, runs / "a")

    def judge(self, folder):
        shutil.copytree(run, runs / "b")  # by another process, meanwhile
        (runs / "b" / "checkpoints" / "last.pt").touch()
        return 0, "good"

    monkeypatch.setattr("drone_rl.cli.evaluation.VerdictCommand.run", judge)
    monkeypatch.setattr(type(sys.stdout), "isatty", lambda self: True)
    assert "policy: outputs/train/runs/a\n" in in_process("verdict").stdout


def test_the_modules_of_the_users_parts_are_part_of_the_next_commands():
    lines = next_steps("verdict", "run", Path("x"), ["cells", "more"]).splitlines()
    assert lines[2] == "  drone-rl explain policy=run 'plugins=[cells,more]'"
