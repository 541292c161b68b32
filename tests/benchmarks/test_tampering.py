"""The checker refuses all tampered certificates."""

import json

import drone_rl
from benchmarks.gamed_certificates import certificate_of
from benchmarks.tampering import TEXTS, count_refused, is_refused, tampered
from tests.verification.checker.making import of_one_cube


def _by_hand():
    """Return a certificate for one cube: collected up to y = 2, lost from y = 3."""
    policy = drone_rl.load_policy("right_and_forward").in_task(num_cubes=1)
    won = {"end": "all_cubes", "collected": [True], "loops": False, "share": 2 / 3}
    lost = {"end": "front_boundary", "collected": [False], "loops": False, "share": 0.25}
    outcomes = [
        {**won, "steps": {"14": 0.4, "15": 0.25}, "boxes": [[[-6.0, 2.0]]]},
        {**lost, "steps": {"27": 0.25}, "boxes": [[[3.0, 6.0]]]},
    ]
    return certificate_of(policy, outcomes, [[[2.0, 3.0]]], 1 / 12)


CERTIFICATE = _by_hand()


def test_there_are_enough_different_files():
    files = list(tampered(CERTIFICATE))
    assert len({content for _, content in files}) == len(files) >= 60
    assert {"cut in half", "a border moved", "hash changed"} <= {name for name, _ in files}


def test_changes_of_bytes_by_hand():
    assert TEXTS["cut in half"](b"{12345}") == b"{12"
    assert TEXTS["infinite share"](b'{"share": 0.5, "share": 1}') == b'{"share": 1e999, "share": 1}'


def test_every_tampered_file_of_a_valid_certificate_is_refused(tmp_path):
    valid = tmp_path / "valid.json"
    valid.write_text(json.dumps(of_one_cube("right_and_forward")))
    assert not is_refused(valid, flights=100)
    found = count_refused({valid: None}, few=200)
    assert found["tampered_accepted"] == []
    assert found["tampered_refused"] == found["tampered_total"] >= 60


def test_refused_files_are_counted(tmp_path, monkeypatch):
    valid = tmp_path / "valid.json"
    valid.write_text(json.dumps(CERTIFICATE))
    monkeypatch.setattr("benchmarks.tampering.is_refused", lambda *a: "hash" not in str(a))
    monkeypatch.setattr("benchmarks.tampering.tampered", lambda data: [("x", b"{}")])
    found = count_refused({valid: "good"})
    assert found == {"tampered_refused": 1, "tampered_total": 1, "tampered_accepted": []}
