"""Forged files and trivial tasks are not judged good or proved."""

import functools

import pytest

import drone_rl
from benchmarks import gamed_certificates
from benchmarks.gamed_certificates import cases, forged_shifts
from drone_rl.policies.zoo import shifts_path
from drone_rl.trust.coverage import find_domain


@pytest.fixture(scope="module", autouse=True)
def _few_episodes():
    """Take fewer episodes, with which honest files are accepted.

    See below for certificates and tests/cli/test_evaluation_verdict.py for operating domains.
    """
    few = functools.partial(
        drone_rl.judge, episodes=150, certificate_flights=400, domain_flights=30
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gamed_certificates, "judge", few)
        yield


@pytest.fixture(scope="module")
def domain(tmp_path_factory):
    """Return the forged operating domain of the policy "good"; measure it once."""
    folder = tmp_path_factory.mktemp("domain")
    data = forged_shifts(gamed_certificates._copy_shipped("good", folder), folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gamed_certificates, "forged_shifts", lambda policy, folder: data)
        yield data


@pytest.mark.parametrize(
    "name",
    [
        "a certificate of one box without steps",
        "a certificate of one box with plausible steps",
        "the certificate of another policy under this name",
        "an invented operating domain",
        "flying straight in a trivial task",
    ],
)
def test_one_case_of_each_kind_is_not_judged_good(domain, tmp_path, name):
    """The benchmark runs all cases."""
    (case,) = [case for case in cases(tmp_path) if case.name == name]
    assert not case.is_judged_good()


def test_names_are_unique(tmp_path):
    names = [case.name for case in cases(tmp_path)]
    assert len(set(names)) == len(names) >= 8


def test_the_forged_domain_is_consistent(domain, tmp_path):
    """Only new episodes can refute it; the reader accepts it."""
    policy = gamed_certificates._copy_shipped("good", tmp_path)
    shifts_path(policy.path).write_text(gamed_certificates.json.dumps(domain))
    measured = find_domain(policy)
    assert measured.refused is None
    assert measured.numbers["domain"]["ranges"]["dead_rows"]["high"] == 12.0


def test_an_honest_certificate_is_proved(tmp_path):
    policy = gamed_certificates._copy_shipped("proved", tmp_path)
    data = gamed_certificates._honest_certificate()
    path = gamed_certificates.certificate_path(policy.path)
    path.write_text(gamed_certificates.json.dumps(data))
    few = {"episodes": 5, "sampled": False, "progress": lambda *_: None}
    assert drone_rl.judge(policy, certificate_flights=400, **few).status("proved") == 0
