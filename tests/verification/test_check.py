"""Checks in Python."""

import json
import os

import pytest

import drone_rl
from drone_rl.policies.zoo import certificate_path
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from tests.verification.checker.making import of_one_cube


@pytest.fixture(scope="module")
def truth():
    return of_one_cube("poor")


@pytest.fixture
def path(truth, tmp_path):
    file = tmp_path / "outputs" / "prove" / "runs" / "1" / "certificate.json"
    file.parent.mkdir(parents=True)
    file.write_text(json.dumps(truth))
    return file


def test_a_check_in_python(path, tmp_path):
    told = []
    done = drone_rl.check(path, flights=50, progress=lambda *how: told.append(how))
    assert done.accepted and done.exit_code == 0
    assert told[-1] == ("flown", 50, 50)
    first, *others = str(done).splitlines()
    assert (
        first.startswith("accepted: ") and "of policy poor with num_cubes=1, 1 boxes, 50" in first
    )
    assert others[0] == "stated: 1 side_boundary, cubes collected: none"
    assert "<td>stated</td>" in done._repr_html_()
    done.save(tmp_path / "check.json")
    kept = json.loads((tmp_path / "check.json").read_text())
    assert kept["accepted"] and kept["task"]["num_cubes"] == 1 and kept["versions"]


def test_the_certificate_that_travels_with_the_package():
    proved = drone_rl.load_policy("proved")
    done = drone_rl.check(certificate_path(proved.path), flights=100, progress=silent)
    assert done.accepted and done.findings.contradicted == 0
    assert drone_rl.load_proof(certificate_path(proved.path)).is_proved
    assert proved.task.num_cubes == 3


def test_the_newest_certificate_and_a_policy_in_a_file(path, tmp_path):
    policy = drone_rl.load_policy("poor")
    done = drone_rl.check(
        "latest", policy.path, outputs=tmp_path / "outputs", flights=5, progress=silent
    )
    assert done.path == path and done.accepted
    older = path.parents[1] / "0" / "certificate.json"
    older.parent.mkdir()
    older.write_text("{")
    os.utime(older, (1, 1))
    drone_rl.check("latest", policy, outputs=tmp_path / "outputs", flights=1, progress=silent)
    with pytest.raises(InputError, match="certificate=latest, but there is none"):
        drone_rl.check("latest", outputs=tmp_path / "elsewhere")


def test_a_lie_is_refused(path, truth):
    lost = {**truth["outcomes"][0], "end": "front_boundary"}
    path.write_text(json.dumps({**truth, "outcomes": [lost]}))
    done = drone_rl.check(path, flights=30, progress=silent)
    assert (done.accepted, done.exit_code) == (False, 14)
    lines = done.lines()
    assert lines[0].startswith("refused: ") and "30 of them ended otherwise" in lines[0]
    assert lines[-2] == "refused: and 10 flights more ended otherwise than stated"
    assert lines[-1] == f"placements: seed {done.seed.value} (fresh)"
    again = drone_rl.check(path, flights=30, seed=done.seed.value, progress=silent)
    assert again.findings == done.findings
    assert (again.as_dict()["seed_is_fixed"], done.as_dict()["seed_is_fixed"]) == (True, False)
    assert "note: Fixed seed" in str(again)
    assert "Fixed seed" not in str(done)


def test_the_policy_must_be_known(path, truth):
    other = {**truth["policy"], "name": "mine"}
    path.write_text(json.dumps({**truth, "policy": other}))
    with pytest.raises(
        InputError, match=r"policy 'mine', which is none of .*give policy= its file"
    ):
        drone_rl.check(path)
    assert drone_rl.check(path, "poor", flights=5, progress=silent).accepted


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"policy": "good"}, "the certificate is for a network with hash"),
        ({"task": {"num_cubes": 2}}, "another task: num_cubes=1, not 2"),
        ({"task": {"num_cubes": 0}}, r"task\.num_cubes=0"),
        ({"flights": 0}, "flights=0 is out of range"),
        ({"flown": 3}, "flown is unknown"),
        ({"device": "tpu"}, "device"),
    ],
)
def test_mistakes_are_told(path, settings, message):
    with pytest.raises(InputError, match=message):
        drone_rl.check(path, progress=silent, **settings)


def test_the_task_that_is_asked_for(path):
    assert drone_rl.check(path, task={"num_cubes": 1}, flights=5, progress=silent).accepted
