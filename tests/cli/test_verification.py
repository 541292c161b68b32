"""`drone-rl prove`, `check`, `places` and `chain`."""

import json

import pytest

from tests.verification.checker.making import of_one_cube


def test_a_proof_for_one_cube(in_process, tmp_path):
    done = in_process(
        "prove", "policy=right_and_forward", "task.num_cubes=1", f"hydra.run.dir={tmp_path}"
    )
    assert done.returncode == 15, done.stderr
    assert "63.75%" in done.stdout
    assert json.loads((tmp_path / "certificate.json").read_text())["finished"]


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


def test_a_map_of_near_places(in_process, tmp_path):
    few = ("nearest=3", "farthest=4", "sideways=2", "compared=50")
    done = in_process("places", "policy=poor", *few, "hydra.run.dir=p")
    assert done.returncode == 0, done.stderr
    assert "With one cube 3 to 4 m ahead" in done.stdout
    kept = json.loads((tmp_path / "p" / "places.json").read_text())
    assert kept["window"] == {"nearest": 3, "farthest": 4, "sideways": 2}
    assert {path.suffix for path in (tmp_path / "p").glob("places.*")} >= {".json", ".png", ".svg"}


ONE = ("task.num_cubes=1", "task.side_margin=2.0", "hydra.run.dir=c")


def test_chances_of_one_placement(in_process, tmp_path):
    done = in_process("chain", "policy=right_and_forward", "cubes=[0.5]", *ONE)
    assert done.returncode == 0, done.stderr
    (placement,) = json.loads((tmp_path / "c" / "chances.json").read_text())["placements"]
    assert placement["cubes"] == [[15.0, 0.5, 2.5]]
    assert 0.9999 < placement["success"] < 1
    assert ">99.99%" in done.stdout.splitlines()[1]
