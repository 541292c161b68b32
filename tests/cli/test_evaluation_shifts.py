"""Flights under other conditions at the command line."""

import json

import pytest

from tests.cli.running import error_line


def test_one_axis(in_process, tmp_path):
    few = ("axes=dead_rows", "strengths=[5]", "modes=[constant]", "episodes=10", "domain=false")
    done = in_process("shifts", "policy=poor", *few, "hydra.run.dir=s")
    assert done.returncode == 0, done.stderr
    assert "dead rows" in done.stdout and "12: " in done.stdout
    kept = json.loads((tmp_path / "s" / "shifts.json").read_text())
    assert kept["axes"]["dead_rows"]["levels"][0]["number"] == 5
    assert {path.name for path in (tmp_path / "s").glob("*.png")} == {"shifts.png", "strips.png"}


@pytest.mark.parametrize(
    ("told", "words"),
    [
        (["axes=wind"], ["axes=wind", "unknown", "object_color"]),
        (["strengths=[0]"], ["strengths[0]=0", "from 1 to 5"]),
        (["modes=[onset]"], ["modes=", "constant"]),
        (["task.cube_size=9"], ["task.altitude=2.5", "cube_size / 2"]),
    ],
)
def test_mistakes_get_one_line(in_process, told, words):
    line = error_line(in_process("shifts", "policy=good", *told))
    assert all(word in line for word in words), line
