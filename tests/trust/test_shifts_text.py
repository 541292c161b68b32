import pytest

from drone_rl.trust.shifts_text import (
    QUOTED,
    SHIFTS,
    inward,
    is_quoted,
    lacking,
    not_evaluated,
    why_not,
)
from drone_rl.utils.errors import InputError
from drone_rl.utils.text import said
from tests.evidence import SHIFTS as EVIDENCE
from tests.evidence import VERDICT, changed


def test_all_sentences():
    text = said(SHIFTS, EVIDENCE)
    assert text["shifts.good"] == (
        "Good with the sun at 21.1 to 60 degrees (no more was tried) and blur of up to 1.5 pixels "
        "(95% confidence for each range)."
    )
    assert text["shifts.not"] == "Not with brightness at 0.8 times: cubes on its right 47.0%."
    assert text["shifts.impossible"].endswith("elevation of the sun at 0 degrees, 45.0%.")
    assert "succeeds in 1.5% of episodes" in text["shifts.together"]
    assert text["shifts.fixed_seed"].startswith("Fixed seed 0: ")
    said_too = ("good", "not", "impossible", "together", "scope", "fixed_seed")
    assert set(text) == {f"shifts.{name}" for name in said_too}


@pytest.mark.parametrize(
    ("value", "low", "high"),
    [
        (1.876, "1.88", "1.87"),
        (21.01, "21.1", "21"),
        (0.03125, "0.0313", "0.0312"),
        (60.0, "60", "60"),
        (0.0, "0", "0"),
        (155.04, "156", "155"),
    ],
)
def test_limits_are_rounded_inwards(value, low, high):
    assert (inward(value, True), inward(value, False)) == (low, high)


def test_no_range_without_a_search_or_without_a_good_policy():
    names = set(said(SHIFTS, changed(EVIDENCE, {"domain": None})))
    assert names == {"shifts.impossible", "shifts.together", "shifts.fixed_seed"}
    bad = {"low": None, "high": None, "positions": None, "failed": [], "low_open": None,
           "high_open": None}  # fmt: skip
    changes = {f"domain.ranges.{name}": bad for name in ("sun", "blur", "brightness")}
    text = said(SHIFTS, changed(EVIDENCE, {"domain.plain.good": False, **changes}))
    assert "no range" in text["shifts.none"]
    assert "good" not in " ".join(v for k, v in text.items() if k != "shifts.none").lower()


def test_axes_without_effect_are_not_claimed():
    same = {"axes.blur.levels.1.modes.constant.unchanged": True}
    text = said(SHIFTS, changed(EVIDENCE, same))
    assert "blur" not in text["shifts.good"]
    assert text["shifts.untested"] == "Not tested, because without effect: blur."


def test_impossible_strengths_are_no_failure_of_the_policy():
    failed = EVIDENCE["domain"]["ranges"]["brightness"]["failed"][0]
    failed = {**failed, "impossible": True, "oracle": {"share": 0.3}}
    text = said(SHIFTS, changed(EVIDENCE, {"domain.ranges.brightness.failed": [failed]}))
    assert "shifts.not" not in text and "shifts.uncertain" not in text
    assert "brightness at 0.8 times, 30.0%" in text["shifts.impossible"]
    end = {**failed, "end": "high", "value": 2.0}
    text = said(SHIFTS, changed(EVIDENCE, {"domain.ranges.blur.failed": [end]}))
    assert "blur of up to 1.5 pixels (no more is possible)" in text["shifts.good"]


def test_uncertain_strengths_are_named():
    dark = EVIDENCE["domain"]["ranges"]["brightness"]["failed"][0]
    near = {**dark, "bad": False, "success": 0.945}
    end = {**near, "end": "high", "value": 2.0, "success": 1.0, "fragile": 31}
    changes = {"domain.ranges.brightness.failed": [near], "domain.ranges.blur.failed": [end]}
    text = said(SHIFTS, changed(EVIDENCE, changes))
    assert text["shifts.uncertain"] == (
        "Not certain, in 400 episodes, whether it is good with blur at 2 pixels (100% succeed; "
        "rounding can change 31) or brightness at 0.8 times (94.5% succeed)."
    )
    assert "shifts.not" not in text and "blur of up to 1.5 pixels" in text["shifts.good"]


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
def test_lacking_range(name, low, high, words):
    found = lacking(EVIDENCE, name, {"low": low, "high": high})
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
def test_single_end_beyond_the_unperturbed_value_is_refused(name, need, words):
    with pytest.raises(InputError, match=f"^{words}$"):
        lacking(EVIDENCE, name, need)


def test_required_fog_has_no_upper_end():
    ranges = {"low": 80.0, "high": None, "positions": [0.0, 1 / 80], "failed": []}  # from clear air
    fog = {**EVIDENCE["axes"]["blur"], "neutral": None, "unit": "m of sight"}
    shifts = changed(EVIDENCE, {"axes.fog": fog, "domain.ranges.fog": ranges})
    assert lacking(shifts, "fog", {"low": 80.0, "high": None}) is None
    found = lacking(shifts, "fog", {"low": 60.0, "high": None})
    assert "needed 60 and more m of sight, good 80 and more m of sight" in found
    clear = changed(shifts, {"domain.ranges.fog.low": None, "domain.ranges.fog.positions": [0, 0]})
    found = lacking(clear, "fog", {"low": 60.0, "high": None})
    assert found == "fog: needed 60 and more m of sight, good only without fog"


def test_untested_axes_cover_nothing():
    need = {"low": None, "high": 1.0}
    same = {"axes.blur.levels.1.modes.constant.unchanged": True}
    assert "not tested" in lacking(changed(EVIDENCE, same), "blur", need)
    nowhere = {"domain.ranges.blur.positions": None}
    assert "without perturbation" in lacking(changed(EVIDENCE, nowhere), "blur", need)
    lost = {"domain.ranges.blur.failed": [{"end": "high", "impossible": True}]}
    assert "impossible even for the oracle" in lacking(
        changed(EVIDENCE, lost), "blur", {"low": None, "high": 2.0}
    )


GOOD = {"verdict": {**VERDICT, "kind": "good", "certain": True}, "shifts": EVIDENCE}


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"shifts": {"refused": "it is of another task"}}, "of another task"),
        ({"verdict.good_share": 0.99}, "requires 0.9 of the oracle's success rate"),
        ({"verdict.kind": "poor"}, "this verdict does not"),
    ],
)
def test_refused_evaluations_are_not_quoted(changes, why):
    evidence = changed(GOOD, changes)
    assert not is_quoted(evidence) and why in why_not(evidence)
    assert list(said(QUOTED, evidence)) == ["domain.refused"]
    assert not_evaluated(evidence) == ["colors", "light", "sizes"]


def test_evaluations_that_do_not_contradict_the_verdict_are_quoted():
    assert is_quoted(changed(GOOD, {"verdict.kind": "poor", "verdict.certain": False}))
    nowhere = {"shifts.domain.plain.good": False, "verdict.kind": "poor"}
    assert is_quoted(changed(GOOD, nowhere))


def test_groups_that_were_not_evaluated():
    assert not_evaluated(GOOD) == ["colors", "sizes"]
    assert not_evaluated({"verdict": VERDICT}) == ["colors", "light", "sizes"]
