import pytest

from drone_rl.trust.shifts_text import contradicted, lacking
from drone_rl.utils.errors import InputError
from tests.evidence import SHIFTS, VERDICT, changed

GOOD = {"verdict": {**VERDICT, "kind": "good", "certain": True}, "shifts": SHIFTS}


@pytest.mark.parametrize(
    ("name", "low", "high", "words"),
    [
        ("sun", 21.07, 60.0, None),
        ("sun", 30.0, None, None),
        ("sun", None, 60.0, None),
        ("sun", 21.0, None, "needed 21 to 55 degrees, good 21.07 to 60 degrees"),
        ("sun", 30.0, 61.0, "needed 30 to 61 degrees"),
        ("blur", None, 1.5, None),
        ("blur", None, 1.6, "needed 0 to 1.6 pixels, good 0 to 1.5 pixels"),
        ("brightness", 0.9, 1.0, "good 1 to 1 times"),
        ("fog", 60.0, None, "fog: not evaluated; run drone-rl shifts with axes=[fog]"),
    ],
)
def test_what_is_lacking(name, low, high, words):
    found = lacking(SHIFTS, name, {"low": low, "high": high})
    assert found == words if words is None else words in found


@pytest.mark.parametrize(
    ("name", "need", "words"),
    [
        ("sun", {"low": None, "high": 50.0}, "elevation of the sun: low is missing and therefore "
         "55 degrees, the value without perturbation, but high is 50; give low, too"),
        ("sun", {"low": 70.0, "high": None}, "elevation of the sun: high is missing and therefore "
         "55 degrees, the value without perturbation, but low is 70; give high, too"),
    ],
)  # fmt: skip
def test_a_single_end_beyond_no_perturbation_is_no_range(name, need, words):
    with pytest.raises(InputError, match=f"^{words}$"):
        lacking(SHIFTS, name, need)


def test_fog_is_needed_up_to_none():
    ranges = {"low": 80.0, "high": None, "positions": [0.0, 1 / 80], "failed": []}  # from clear air
    fog = {**SHIFTS["axes"]["blur"], "neutral": None, "unit": "m of sight"}
    shifts = changed(SHIFTS, {"axes.fog": fog, "domain.ranges.fog": ranges})
    assert lacking(shifts, "fog", {"low": 80.0, "high": None}) is None
    found = lacking(shifts, "fog", {"low": 60.0, "high": None})
    assert "needed 60 and more m of sight, good 80 and more m of sight" in found
    clear = changed(shifts, {"domain.ranges.fog.low": None, "domain.ranges.fog.positions": [0, 0]})
    found = lacking(clear, "fog", {"low": 60.0, "high": None})
    assert found == "fog: needed 60 and more m of sight, good only without fog"


def test_what_new_episodes_say_against_a_file():
    probed = {"bad": True, "refused": None, "success": 0.5}
    assert contradicted("blur", 1.0, "pixels", probed) == (
        "blur at 1 pixels: 50.0% of new episodes succeed, so the policy is certainly not good "
        "there; the file states that it is"
    )
    assert contradicted(None, 0.0, "", probed).startswith("without perturbation: 50.0% of new epis")
    refused = contradicted("blur", 1.0, "pixels", {"bad": True, "refused": "too large"})
    assert refused == "blur at 1 pixels: the task does not allow it (too large)"


def test_what_was_no_test_covers_nothing_and_what_nobody_can_is_said():
    need = {"low": None, "high": 1.0}
    same = {"axes.blur.levels.1.modes.constant.unchanged": True}
    assert "not tested" in lacking(changed(SHIFTS, same), "blur", need)
    nowhere = {"domain.ranges.blur.positions": None}
    assert "without perturbation" in lacking(changed(SHIFTS, nowhere), "blur", need)
    lost = {"domain.ranges.blur.failed": [{"end": "high", "impossible": True}]}
    assert "impossible even for the oracle" in lacking(
        changed(SHIFTS, lost), "blur", {"low": None, "high": 2.0}
    )
