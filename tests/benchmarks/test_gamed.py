"""Policies that deceive an analysis with a known seed, rounding or forged files do not succeed."""

import functools

import pytest

import drone_rl
from benchmarks import gamed, gamed_certificates, gamed_memory, gamed_rounding
from drone_rl.utils.errors import InputError


def test_a_policy_that_depends_on_the_batch_is_not_good(tmp_path):
    assert not gamed_rounding.cases(tmp_path)["bad one at a time"]()


def test_non_finite_logits_are_an_error(tmp_path):
    with pytest.raises(InputError, match="non-finite action logits"):
        drone_rl.judge(gamed_rounding.non_finite(tmp_path), episodes=4)


@pytest.mark.parametrize(
    "name",
    [
        "a certificate of one box with plausible steps",
        "flying straight in a trivial task",
    ],
)
def test_forged_files_and_trivial_tasks_are_not_good(name, tmp_path, monkeypatch):
    few = functools.partial(drone_rl.judge, episodes=150, certificate_flights=400)
    monkeypatch.setattr(gamed_certificates, "judge", few)
    assert not gamed_certificates.cases(tmp_path)[name]()


def test_deceived_analyses_are_counted(setup, monkeypatch):
    for module in (gamed_memory, gamed_rounding, gamed_certificates):
        outcomes = {f"{module} fooled": lambda: True, f"{module} not": lambda: False}
        monkeypatch.setattr(module, "cases", lambda folder, outcomes=outcomes: outcomes)
    assert gamed.bench_gamed(setup) == {"gamed_verdicts": 3, "gamed_total": 6}
