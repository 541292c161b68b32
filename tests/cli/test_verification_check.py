"""Checks are exit statuses."""

import json

import pytest

from tests.cli.running import error_line
from tests.verification.checker.making import of_one_cube


@pytest.fixture(scope="module")
def truth():
    return of_one_cube("poor")


@pytest.mark.parametrize(
    ("end", "status", "word"), [("side_boundary", 0, "accepted"), ("front_boundary", 14, "refused")]
)
def test_checks_are_exit_statuses(in_process, tmp_path, truth, end, status, word):
    outcomes = [{**truth["outcomes"][0], "end": end}]
    (tmp_path / "c.json").write_text(json.dumps({**truth, "outcomes": outcomes}))
    done = in_process("check", "certificate=c.json", "flights=40", "hydra.run.dir=out")
    assert done.returncode == status, done.stderr
    assert done.stdout.startswith(f"{word}: c.json, of policy poor with num_cubes=1")
    kept = json.loads((tmp_path / "out" / "check.json").read_text())
    assert kept["accepted"] == (status == 0)


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (["certificate=none.json"], ["none.json can't be read"]),
        (["certificate=c.json"], ["c.json can't be used", "no plain JSON"]),
        (["certificate=t.json", "policy=good"], ["hash", "set policy to the file"]),
        (["certificate=t.json", "task.num_cubes=2"], ["num_cubes=1, not 2"]),
        (["flights=0"], ["flights=0", "from 1"]),
        ([], ["certificate=latest", "drone-rl prove"]),
    ],
)
def test_mistakes_get_one_line(in_process, tmp_path, truth, command, words):
    (tmp_path / "c.json").write_text(json.dumps(truth)[:-9])
    (tmp_path / "t.json").write_text(json.dumps(truth))
    done = in_process("check", *command)
    assert done.returncode == 2
    line = error_line(done)
    assert all(word in line for word in words), line
