"""Help tells of each knob what its file says."""

import itertools
from pathlib import Path

import pytest
from omegaconf import OmegaConf

from drone_rl.cli.hydra.help import _with_parents, comments, explained, read_comments, show_help
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
    show_help(command, CONF, ["--help"])
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
