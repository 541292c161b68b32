"""Help: comments, units and choices of settings, examples, and the next commands."""

import itertools
import shutil
import sys

import pytest

from drone_rl.cli.commands import TABLE
from drone_rl.cli.hydra.composition import store_defaults
from drone_rl.cli.hydra.help import next_steps, show_help
from drone_rl.cli.hydra.mistakes import composed
from drone_rl.cli.main import find_command
from drone_rl.utils.errors import InputError
from tests.cli.hydra.conftest import FILES


@pytest.mark.parametrize("command", FILES)
def test_every_setting_of_every_command_is_explained(command, config, capsys):
    show_help(command, ["--help"], find_command(command.replace("_", "-")), ["all"])
    lines = capsys.readouterr().out.partition("used now:\n")[2].partition("\nexamples")[0]
    for before, line in itertools.pairwise(lines.splitlines()):
        is_setting = before[:3].strip() != ""
        assert not is_setting or line.startswith("      "), before


def test_help_shows_units_defaults_and_choices(config, capsys):
    show_help("train", ["--help", "seed=7"], find_command("train"))
    text = capsys.readouterr().out
    assert "  evaluate_after=0  (episodes)\n      Episodes of a verdict" in text
    assert "  trainer\n      Training loop: stopping rule" in text and "trainer.total" not in text
    assert "  seed=7\n" in text
    assert "  objective=reinforce\n      One of: a2c, ppo, reinforce.\n" in text
    assert "drone-rl evaluate" not in text


def test_help_of_a_group_or_setting_shows_only_that(config, capsys):
    train = find_command("train")
    show_help("train", ["--help"], train, ["optimizer", "experiment", "num_cubes"])
    text = capsys.readouterr().out
    assert "  optimizer=adam\n      One of: adam, sgd.\n" in text and "  experiment=" in text
    assert "  optimizer.lr=0.001\n      Learning rate.\n" in text
    assert "  task.num_cubes=3  (cubes)\n" in text
    assert "spacing" not in text and "trainer" not in text.partition("examples")[0]
    with pytest.raises(InputError, match=r"^drone-rl train has no setting foo; "):
        show_help("train", ["--help"], train, ["foo"])


@pytest.mark.parametrize("name", TABLE)
def test_examples_are_command_lines_of_the_command(name):
    command, lines = name.replace("-", "_"), [line for line, _ in TABLE[name]["examples"]]
    store_defaults({command: find_command(name)})
    for line in lines:
        first, second, *words = line.split()
        assert (first, second) == ("drone-rl", name)
        typed = find_command(name).prepare([w for w in words if "resume=" not in w])
        composed(command, [w for w in typed if not w.startswith("-") and "," not in w])


def test_the_policy_and_the_next_commands():
    assert next_steps("shifts", "my run", ["cells", "more"]).splitlines() == [
        "policy: my run",
        "next:",
        "  drone-rl verdict 'policy=my run' 'plugins=[cells,more]'",
        "  drone-rl play 'policy=my run' 'plugins=[cells,more]'",
    ]
    assert next_steps("bench", "latest") == ""


@pytest.mark.parametrize("name", TABLE)
def test_next_commands_exist_with_these_settings(name):
    for line in next_steps(name, "good").splitlines()[2:]:
        command, *words = line.split()[1:]
        store_defaults({command: find_command(command)})
        composed(command, words)


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
