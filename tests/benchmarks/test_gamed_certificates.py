"""Attempts with forged files and trivial tasks: none is called good or proved."""

import pytest

import drone_rl
from benchmarks import gamed_certificates
from benchmarks.gamed_certificates import cases, invented
from drone_rl.policies.zoo import shifts_path
from drone_rl.verdicts.coverage import find_domain

NAMES = [case.name for case in cases(drone_rl.load_policy("good").path.parent)]


@pytest.mark.parametrize("name", NAMES)
def test_none_is_called_good(tmp_path, name):
    (case,) = [case for case in cases(tmp_path) if case.name == name]
    assert not case.called_good()


def test_names_differ():
    assert len(set(NAMES)) == len(NAMES) >= 8


def test_the_invented_domain_goes_together_and_is_believed_but_for_new_episodes(tmp_path):
    """It is no test of the reader: only rollouts refute it."""
    policy = gamed_certificates._copied("good", tmp_path)
    shifts_path(policy.path).write_text(gamed_certificates.json.dumps(invented(policy, tmp_path)))
    measured = find_domain(policy)
    assert measured.refused is None
    assert measured.numbers["domain"]["ranges"]["dead_rows"]["high"] == 12.0


def test_an_honest_certificate_is_proved(tmp_path):
    policy = gamed_certificates._copied("proved", tmp_path)
    data = gamed_certificates._proved()
    path = gamed_certificates.certificate_path(policy.path)
    path.write_text(gamed_certificates.json.dumps(data))
    few = {"episodes": 5, "sampled": False, "progress": lambda *_: None}
    assert drone_rl.judge(policy, certificate_flights=400, **few).status("proved") == 0
