"""Quick benchmarks of proofs: real proofs for one cube."""

import json

import pytest

from benchmarks import proving
from benchmarks.proving import bench_many_cubes, bench_prove, bench_tampering
from benchmarks.tampering import is_refused, tampered


def test_proofs_and_their_checks(tmp_path):
    found = bench_prove(tmp_path, [0, 1], quick=True)
    assert len(found["proof_three_s"]) == len(found["proof_success"]) == 1
    assert found["proof_checked"] == found["proof_checked_total"] == 4
    assert found["proof_contradicted"] == 0 and found["proof_flights"] >= 300
    assert 0 <= found["proof_undecided"] < 1e-3


def test_certificates_that_are_tampered_with_are_valid(tmp_path, monkeypatch):
    """test_tampering.py tampers with a certificate in every way."""
    monkeypatch.setattr(proving, "count_refused", lambda certificates: [*certificates.items()])
    ((path, policy),) = bench_tampering(tmp_path, quick=True)
    assert policy is None and not is_refused(path, flights=100)
    assert len([*tampered(json.loads(path.read_text()))]) >= 60


def test_many_cubes_stops_at_the_time_limit(tmp_path):
    found = bench_many_cubes(tmp_path, 1.0, quick=True)
    assert found["proof_four"] == pytest.approx(found["proof_five"]) == pytest.approx(0.0)
    assert found["proof_four_s"] > 1.0
