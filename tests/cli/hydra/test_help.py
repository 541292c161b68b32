"""Help tells of each knob what its file says."""

import itertools
from pathlib import Path

import pytest
from omegaconf import OmegaConf

from drone_rl.cli.commands import TABLE
from drone_rl.cli.hydra.composition import register_schemas
from drone_rl.cli.hydra.help import (
    _with_parents,
    comments,
    explained,
    read_comments,
    show_help,
)
from drone_rl.cli.hydra.names import composed
from drone_rl.cli.main import find_command
from drone_rl.utils.errors import InputError
from tests.cli.hydra.conftest import FILES

CONF = Path(__file__).parents[3] / "conf"


def test_the_comment_above_a_knob_is_its_own():
    found = read_comments(CONF / "transforms" / "original.yaml")
    assert found == {
        "gray": "RGB bytes to gray from 0 to 1.",
        "standardize": "Shift and scale: (x - mean) / std.",
        "standardize.mean": "Gray level that becomes 0.",
        "standardize.std": "Deviation that becomes 1.",
        "crop": "Crop to the rows from top (included) to bottom (excluded).",
        "crop.top": "First row.",
        "crop.bottom": "First row that is not kept.",
    }


def test_a_file_says_what_the_files_do_that_it_starts_from():
    found = comments("train", CONF, {"transforms": "original", "task": "collect_one"})
    assert found["transforms.gray"] == "RGB bytes to gray from 0 to 1."
    assert found["transforms.crop.top"] == "First row."
    assert found["task.spacing"] == "Distance in x from one cube to the next."
    assert found["seed"].startswith("Root of all random streams")


def test_values_stand_below_their_comments():
    values = {"a": 1, "b": {"_target_": "x", "c": [1, 2]}, "d": None, "e": "text", "f": {}}
    assert list(explained(values, {"a": "one\ntwo", "b.c": "inside"})) == [
        *("# one", "# two", "a: 1", "b:", "  # inside", "  c: [1, 2]"),
        *("d: null", "e: text", "f: {}"),
    ]


@pytest.mark.parametrize("command", FILES)
def test_every_knob_of_every_command_is_explained(command, config, capsys):
    show_help(command, CONF, ["--help"], find_command(command.replace("_", "-")), ["all"])
    lines = [line.strip() for line in capsys.readouterr().out.splitlines()]
    told = lines[lines.index("Settings, as they would be used now:") :]
    for before, line in itertools.pairwise(told):
        is_value = ": " in line and not line.startswith("#") and "drone-rl" not in line
        assert not is_value or before.startswith("#"), line


@pytest.mark.parametrize(
    "path", sorted(CONF.rglob("*.yaml")), ids=lambda p: str(p.relative_to(CONF))
)
def test_every_knob_of_every_file_has_a_comment(path):
    if path.parent.name == "hydra":
        return
    values = OmegaConf.to_container(OmegaConf.load(path), resolve=False)
    found = {name for file in _with_parents(path) for name in read_comments(file)}
    for name, value in (values or {}).items():
        if name == "defaults" or isinstance(value, dict):
            continue
        assert name.startswith("_") or name in found, name


@pytest.mark.parametrize("command", FILES)
def test_help_begins_with_the_most_used_settings(command, config, capsys):
    name = command.replace("_", "-")
    show_help(command, CONF, ["--help"], find_command(name))
    lines = capsys.readouterr().out.splitlines()
    shown = [line.strip().partition("=")[0] for line in lines if line[:3].strip() and "=" in line]
    assert [key for key in shown if key in TABLE[name]["settings"]] == TABLE[name]["settings"]
    assert f"drone-rl {name} --help all" in "\n".join(lines)
    settings = lines[2 + lines.index("") : lines.index("examples")]
    assert len(settings) < 60 and max(map(len, settings)) <= 100
    values = [i for i, line in enumerate(lines) if line.startswith("  ") and line[2] != " "]
    assert all(lines[i + 1].startswith("      ") for i in values if i < lines.index("examples"))


def test_help_shows_units_defaults_and_choices(config, capsys):
    show_help("train", CONF, ["--help", "seed=7"], find_command("train"))
    text = capsys.readouterr().out
    assert "  trainer.total_frames=2000000  (frames)\n      Stop after" in text
    assert "  seed=7\n" in text
    assert "  objective=reinforce\n      One of: a2c, ppo, reinforce.\n" in text
    assert "drone-rl evaluate" not in text


def test_help_of_a_group_or_setting_shows_only_that(config, capsys):
    train = find_command("train")
    show_help("train", CONF, ["--help"], train, ["optimizer", "experiment", "num_cubes"])
    text = capsys.readouterr().out
    assert "  optimizer: adam, sgd\n" in text and "  experiment: default\n" in text
    assert "  optimizer:\n    # Learning rate.\n    lr: 0.001\n" in text
    assert "    num_cubes: 3\n" in text
    assert "spacing" not in text and "trainer" not in text.partition("examples")[0]
    with pytest.raises(InputError, match=r"^drone-rl train has no setting foo; drone-rl train --h"):
        show_help("train", CONF, ["--help"], train, ["foo"])


@pytest.mark.parametrize("name", TABLE)
def test_examples_are_command_lines_of_the_command(name):
    command, lines = name.replace("-", "_"), [line for line, _ in TABLE[name]["examples"]]
    register_schemas(**{command: find_command(name)})
    for line in lines:
        first, second, *words = line.split()
        assert (first, second) == ("drone-rl", name)
        typed = find_command(name).prepare([w for w in words if "resume=" not in w])
        composed(command, CONF, [w for w in typed if not w.startswith("-") and "," not in w])
