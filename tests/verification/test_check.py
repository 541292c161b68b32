"""Checks of certificates from Python."""

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


def test_an_accepted_certificate(path, tmp_path):
    reports = []
    done = drone_rl.check(path, flights=50, progress=lambda *how: reports.append(how))
    assert done.accepted and done.exit_code == 0
    assert reports[-1] == ("flown", 50, 50)
    assert (
        str(done).startswith("accepted: ")
        and ": not refuted, wrong" in str(done)
        and "<td>stated</td>" in done._repr_html_()
    )
    done.save(tmp_path / "check.json")
    kept = json.loads((tmp_path / "check.json").read_text())
    assert kept["accepted"] and kept["task"]["num_cubes"] == 1 and kept["versions"]


def test_the_shipped_certificate():
    proved = drone_rl.load_policy("proved")
    done = drone_rl.check(certificate_path(proved.path), flights=100, progress=silent)
    assert done.accepted and done.contradicted == 0
    read = drone_rl.load_proof(certificate_path(proved.path))
    assert read.success == 1.0 and not read.is_proved
    assert read.notes()[0].startswith("Stated by its file, not proved here: with its most")
    assert proved.task.num_cubes == 3


def test_the_newest_certificate_and_a_policy_in_a_file(path, tmp_path):
    policy = drone_rl.load_policy("poor")
    done = drone_rl.check(
        "latest", policy.path, outputs=tmp_path / "outputs", flights=5, progress=silent
    )
    assert done.certificate == str(path) and done.accepted
    older = path.parents[1] / "0" / "certificate.json"
    older.parent.mkdir()
    older.write_text("{")
    os.utime(older, (1, 1))
    drone_rl.check("latest", policy, outputs=tmp_path / "outputs", flights=1, progress=silent)
    with pytest.raises(InputError, match="certificate=latest, but there is none"):
        drone_rl.check("latest", outputs=tmp_path / "elsewhere")


def test_a_false_certificate_is_refused(path, truth):
    lost = {**truth["outcomes"][0], "end": "front_boundary"}
    path.write_text(json.dumps({**truth, "outcomes": [lost]}))
    done = drone_rl.check(path, flights=30, progress=silent)
    assert (done.accepted, done.exit_code) == (False, 14)
    assert str(done).startswith("refused: ") and done.contradicted == 30
    again = drone_rl.check(path, flights=30, seed=done.seed, progress=silent)
    assert (again.contradictions, again.flights) == (done.contradictions, done.flights)
    assert (again.seed_is_fixed, done.seed_is_fixed) == (True, False)


def test_the_policy_must_be_known(path, truth):
    other = {**truth["policy"], "name": "mine"}
    path.write_text(json.dumps({**truth, "policy": other}))
    with pytest.raises(InputError, match="policy 'mine', which is none of"):
        drone_rl.check(path)
    assert drone_rl.check(path, "poor", flights=5, progress=silent).accepted
