import pytest

from benchmarks.gamed_rounding import cases, judged_good, non_finite
from drone_rl.utils.errors import InputError
from drone_rl.verdicts.judge import judge


def test_there_are_enough_kinds(tmp_path):
    found = cases(tmp_path)
    assert len({case.name for case in found}) == len(found) >= 8
    assert len([*tmp_path.glob("*.safetensors")]) >= 7


@pytest.mark.parametrize(
    "name",
    [
        "proved for one cube by rounding",
        "proved by a borrowed certificate",
        "in an operating domain by rounding",
        "bad one at a time",
    ],
)
def test_none_is_called_good(tmp_path, name):
    (case,) = (case for case in cases(tmp_path) if case.name == name)
    assert not case.called_good()


def test_honest_policies_are_called_good():
    assert judged_good("good")


def test_non_finite_logits_end_the_run_with_one_line(tmp_path):
    with pytest.raises(InputError, match=r"policy=non_finite gives non-finite action logits"):
        judge(non_finite(tmp_path), episodes=4)
