import functools
from types import SimpleNamespace

import pytest

from benchmarks import gamed_rounding
from benchmarks.gamed_rounding import cases, judged_good, non_finite
from drone_rl.trust.judge import judge
from drone_rl.trust.shifts import shifts
from drone_rl.utils.errors import InputError
from drone_rl.verification.prove import prove


@pytest.fixture(scope="module", autouse=True)
def _few_episodes():
    """Take fewer episodes and prove for a narrow field.

    These numbers are enough for honest policies: see the next test, test_gamed_memory.py (120
    episodes of `shifts`) and test_gamed_certificates.py (400 of a certificate).
    """
    task = {"num_cubes": 1, "lateral_bound": 0.1}
    changed = {
        "judge": functools.partial(judge, certificate_flights=400),
        "shifts": lambda path, **how: shifts(path, **{**how, "domain_episodes": 120}),
        "prove": lambda path, **how: prove(path, **{**how, "task": task}),
    }
    with pytest.MonkeyPatch.context() as patch:
        for name, function in changed.items():
            patch.setattr(gamed_rounding, name, function)
        yield


def test_an_honest_policy_is_proved_for_the_narrow_field():
    assert gamed_rounding.proved("good")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rounding")
    return folder, {case.name: case for case in cases(folder)}


def test_there_are_at_least_8_cases_and_7_files(made):
    folder, found = made
    assert len(found) >= 8
    assert len([*folder.glob("*.safetensors")]) >= 7


@pytest.mark.parametrize(
    "name",
    [
        "proved for one cube by rounding",
        "proved by a borrowed certificate",
        "in an operating domain by rounding",
        "bad one at a time",
    ],
)
def test_one_case_of_each_analysis_is_not_judged_good(made, name):
    """The benchmark runs all cases."""
    assert not made[1][name].is_judged_good()


def test_only_a_status_of_success_counts_as_judged_good(monkeypatch):
    for status in (0, 13):
        verdict = SimpleNamespace(verdict=SimpleNamespace(exit_code=status))
        monkeypatch.setattr(gamed_rounding, "judge", lambda policy, verdict=verdict, **_: verdict)
        assert judged_good("good") == (status == 0)


def test_non_finite_logits_are_an_error_of_one_line(tmp_path):
    with pytest.raises(InputError, match=r"policy=non_finite gives non-finite action logits"):
        judge(non_finite(tmp_path), episodes=4)
