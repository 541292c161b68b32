"""Attempts with forged files and trivial tasks: none is called good or proved."""

import pytest

import drone_rl
from benchmarks import gamed_certificates
from benchmarks.gamed_certificates import cases, invented
from drone_rl.policies.zoo import shifts_path
from drone_rl.verdicts.coverage import find_domain


@pytest.fixture(scope="module")
def domain(tmp_path_factory):
    """The invented operating domain of the policy "good", without measuring it again."""
    folder = tmp_path_factory.mktemp("domain")
    data = invented(gamed_certificates._copied("good", folder), folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gamed_certificates, "invented", lambda policy, folder: data)
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
def test_one_attempt_of_each_kind_is_not_called_good(domain, tmp_path, name):
    """The benchmark runs all of them."""
    (case,) = [case for case in cases(tmp_path) if case.name == name]
    assert not case.called_good()


def test_names_differ(tmp_path):
    names = [case.name for case in cases(tmp_path)]
    assert len(set(names)) == len(names) >= 8


def test_the_invented_domain_is_refuted_by_new_episodes_only(domain, tmp_path):
    """It is no test of the reader."""
    policy = gamed_certificates._copied("good", tmp_path)
    shifts_path(policy.path).write_text(gamed_certificates.json.dumps(domain))
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
