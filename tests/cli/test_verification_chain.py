"""Exact chances at the command line."""

import json

import pytest

from tests.cli.running import error_line

ONE = ("task.num_cubes=1", "task.side_margin=2.0", "hydra.run.dir=c")


def test_one_placement(in_process, tmp_path):
    done = in_process("chain", "policy=right_and_forward", "cubes=[0.5]", *ONE)
    assert done.returncode == 0, done.stderr
    (placement,) = json.loads((tmp_path / "c" / "chances.json").read_text())["placements"]
    assert placement["cubes"] == [[15.0, 0.5, 2.5]]
    assert 0.9999 < placement["success"] < 1
    assert "more than 99.99%" in done.stdout.splitlines()[1]


def test_held_out_placements(in_process):
    done = in_process("chain", "policy=right_and_forward", "placements=2", "seed=1", *ONE)
    assert done.returncode == 0, done.stderr
    assert "2 placements; failure is most probable at cubes=[2.09944]" in done.stdout  # to the left


@pytest.mark.parametrize(
    ("told", "words"),
    [
        (["cubes=[1.0,2.0]"], ["cubes=(1.0, 2.0)", "must have 3", "task.num_cubes"]),
        (["cubes=[1.0,2.0,9.0]"], ["from -6 to 6"]),
        (["within=-0.1"], ["within=-0.1", "0"]),
        (["within=0.1", "parts=0"], ["parts=0", "1"]),
        (["placements=0"], ["placements=0", "1 or more"]),
        (["task.num_cubes=20"], ["num_cubes=20", "fewer cubes"]),
    ],
)
def test_mistakes_get_one_line(in_process, told, words):
    line = error_line(in_process("chain", "policy=good", *told))
    assert all(word in line for word in words), line
