"""Exact maps at the command line."""

import json

import pytest

from tests.cli.running import error_line


def test_a_map_of_near_places(in_process, tmp_path):
    few = ("nearest=3", "farthest=4", "sideways=2", "compared=50")
    done = in_process("places", "policy=poor", *few, "hydra.run.dir=p")
    assert done.returncode == 0, done.stderr
    assert "With one cube 3 to 4 m ahead" in done.stdout
    kept = json.loads((tmp_path / "p" / "places.json").read_text())
    assert kept["window"] == {"nearest": 3, "farthest": 4, "sideways": 2}
    assert {path.suffix for path in (tmp_path / "p").glob("places.*")} >= {".json", ".png", ".svg"}


@pytest.mark.parametrize(
    ("told", "words"),
    [
        (["nearest=30"], ["nearest=30", "farthest=20"]),
        (["task.cube_size=4", "nearest=1.9"], ["nearest=1.9", "more than 2"]),
        (["sideways=-1"], ["sideways=-1", "out of range"]),
        (["task.vertical_bound=1"], ["vertical_bound=1"]),
    ],
)
def test_mistakes_get_one_line(in_process, told, words):
    line = error_line(in_process("places", "policy=good", "compared=10", *told))
    assert all(word in line for word in words), line
