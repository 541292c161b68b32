"""Policies in several bodies at the command line."""

import json

import pytest

from tests.cli.running import error_line


def test_a_table_and_files(in_process, tmp_path):
    few = ("episodes=3", "bodies=[computer vision,simple flight]", "num_envs=3")
    done = in_process("bodies", "policies=[good]", *few, "hydra.run.dir=b")
    assert done.returncode == 0, done.stderr
    head, row = done.stdout.splitlines()[:2]
    assert head.split() == ["computer", "vision", "simple", "flight"]
    assert row.startswith("good")
    kept = json.loads((tmp_path / "b" / "bodies.json").read_text())
    assert kept["bodies"] == ["computer vision", "simple flight"]
    assert {p.suffix for p in (tmp_path / "b").glob("bodies.*")} == {".json", ".png", ".svg"}


@pytest.mark.parametrize(
    ("told", "words"),
    [
        (["bodies=[submarine]"], ["submarine", "simple flight"]),
        (["policies=[nobody]"], ["nobody"]),
        (["policies=[]"], ["policies"]),
        (["policies=[good,good]"], ["policies", "each once"]),
        (["bodies=[simple flight,simple flight]"], ["bodies", "each once"]),
    ],
)
def test_mistakes_get_one_line(in_process, told, words):
    line = error_line(in_process("bodies", *told))
    assert all(word in line for word in words), line
