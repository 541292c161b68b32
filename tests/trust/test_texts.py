"""A claim of a verdict or robustness evaluation disappears when the result contradicts it."""

import pytest

from drone_rl.trust.findings import Finding, untested
from drone_rl.trust.results import Verdict
from drone_rl.trust.shifts_results import Robustness, SavedShifts, find, inward
from tests.evidence import PROOF, SAVED_SHIFTS, SHIFTS, VERDICT, changed

NOISY = {"inputs": {"pixels": {"transforms": [{"name": "noise"}]}}}
KINDS = {
    "verdict": (lambda result: Verdict.read(result).sentence, VERDICT),
    "findings": (
        lambda result: " ".join(one.text for one in Verdict.read(result).own_findings),
        VERDICT,
    ),
    "shifts": (lambda result: Robustness.read(result).sentence, SHIFTS),
    "line": (lambda result: SavedShifts.read(result).finding(GOOD).text, SAVED_SHIFTS),
}
GOOD = Verdict.read({**VERDICT, "kind": "good"})
SOLVED = {"value": -0.05, "lower": -0.1, "upper": 0.0, "thresholds": [0.0]}
TRIVIAL = {
    "baselines.forward.success.share": 0.95,
    "quantities": {"unsolved by forward": SOLVED},
}
BLIND = {k: v for k, v in VERDICT["baselines"].items() if k != "oracle"}
WIND = {"unlike": {"wind": {"own": [0.0, 0.0, 0.0], "flown": [5.0, 0.0, 0.0]}}}
NEVER_FAILED = {"failures.largest": None, "failures.bound.successes": 0}
PROVED = {"proof": PROOF}
NOWHERE_GOOD = {"domain.plain.good": False, **{
    f"domain.ranges.{axis}.positions": None for axis in ("sun", "blur", "brightness")
}}  # fmt: skip
DARK = SHIFTS["domain"]["ranges"]["brightness"]["failed"][0]
NEAR = {"domain.ranges.brightness.failed": [{**DARK, "bad": False}]}
CLAIMS = [
    ("verdict", "neither good nor poor nor one-sided: it collects every cube in 60.0% of", {},
     {"certain": False}),
    ("verdict", "400 episodes are too few to be certain (about 1,600 might do)",
     {"certain": False, "enough": 1600}, {"certain": True}),
    ("verdict", "alone. With one environment at a time, 2 of 50 episodes drawn at random end",
     {"repetition.runs.0.different": 2}, {"repetition.runs.0.different": 1}),
    ("verdict", "It does not use its camera: with the images of other episodes it collects every "
     "cube in 10.0% of episodes, with its own in 60.0%",
     {"camera.success": {"mean": 0.0, "lower95": -0.1, "upper95": 0.1, "count": 200}},
     {"camera.success.upper95": 0.11}),
    ("verdict", "does its task: it collects", {"kind": "good"}, {"kind": "poor"}),
    ("verdict", "can't be trusted with cubes on its left", {"kind": "one-sided (right)"},
     {"kind": "one-sided (left)"}),
    ("verdict", "here it flew with dynamics.wind=[5, 0, 0] instead of [0, 0, 0]", WIND,
     {"unlike": {}}),
    ("verdict", "in the scenes a.xml, b.xml and judged there, so it may know these scenes alone;",
     {"known_scenes": ["a.xml", "b.xml"]}, {"known_scenes": []}),
    ("verdict", "Fixed seed 0: a policy could have been fitted to these environments.", {},
     {"seed_is_fixed": False}),
    ("verdict", "A certificate of success from every placement is", PROVED, {"proof.every": False}),
    ("verdict", "is not refuted by 3,000 episodes from fresh placements (seed 17): wrong on at "
     "most 0.13% of placements", PROVED, {"proof.computed": True}),
    ("verdict", "not checked, so it proves nothing here",
     {"proof": {**PROOF, "wrong_at_most": None}}, {"proof.wrong_at_most": 0.01}),
    ("verdict", "is proved: computed here", {"proof": {**PROOF, "computed": True}},
     {"proof.computed": False}),
    ("verdict", "A certificate is refused: it is old.", {"proof": {"refused": "it is old"}},
     {"proof": None}),
    ("verdict", 'This task is trivial: the baseline "always forward" collects', TRIVIAL,
     {"quantities.unsolved by forward.value": 0.01}),
    ("verdict", "There is no oracle to compare with. So thresholds are absolute: a good policy "
     "collects every cube in more than 90.0% of episodes", {"baselines": BLIND},
     {"baselines": VERDICT["baselines"]}),
    ("verdict", "The oracle is unusable: it collects every cube in 2.0% of episodes. So thresholds",
     {"baselines.oracle.success.share": 0.02}, {"baselines.oracle.success.share": 0.6}),
    ("findings", "It failed in none of 400 episodes, so it fails in at most 45.0% (95% CI).",
     NEVER_FAILED, {"failures.bound.successes": 1}),
    ("findings", "With sampled actions it collects every cube in 40.0%", {},
     {"drawing.upper95": 0.05}),
    ("shifts", "Good with the sun at 21.1 to 60 degrees (certainly not at 9, no more was tried and "
     "fails in at most 2.5% of episodes at strengths drawn from it) and blur of up to 1.5 pixels "
     "(fails in at most 2.5% of episodes at strengths drawn from it) (95% confidence"
     " for each range).", {}, {"domain.ranges.sun.high_open": False}),
    ("shifts", "and blur of", {}, {"axes.blur.levels.1.modes.constant.unchanged": True}),
    ("shifts", "Not good over the whole range of blur that was found: 100% (95% CI 80.0% to 100%)",
     {"domain.ranges.blur.test.success.lower95": 0.8},
     {"domain.ranges.blur.test.success.lower95": 0.91}),
    ("shifts", "Not with brightness at 0.8 times: cubes on its right 47.0%.", {},
     {"domain.ranges.brightness.failed.0.impossible": True}),
    ("shifts", "there is no range in which it is", NOWHERE_GOOD, {"domain.plain.good": True}),
    ("shifts", "Not tested: blur (no effect)",
     {"axes.blur.levels.1.modes.constant.unchanged": True},
     {"axes.blur.levels.1.modes.constant.unchanged": False}),
    ("shifts", "Without the faults of its inputs in training (noise)",
     {"network": {"weights": "", "description": NOISY}},
     {"network": None}),
    ("shifts", "no usable oracle, so a good policy succeeds in more than 90.0% of episodes",
     {"domain.is_absolute": True}, {"domain.is_absolute": False}),
    ("shifts", "Fixed seed 0", {}, {"seed_is_fixed": False}),
    ("line", "With elevation of the sun at 0 degrees it succeeds in 10.0% of episodes, "
     "unperturbed in 100%; good with the sun at", {"shifts.axes.sun.levels.1.impossible": False},
     {"shifts.axes.sun.levels.1.impossible": True}),
    ("line", "see shifts.json, dated 2026-01-31 12:00, 200 episodes at each strength. Fixed seed",
     {},
     {"shifts.seed_is_fixed": False}),
]  # fmt: skip
"""Result, a part of its text, what it needs, and what contradicts it."""


@pytest.mark.parametrize("row", CLAIMS, ids=lambda row: row[1])
def test_a_contradicted_claim_is_not_made(row):
    kind, part, needed, against = row
    text, example = KINDS[kind]
    result = changed(example, needed)
    assert part in text(result)
    assert part not in text(changed(result, against))


def test_a_policy_is_proved_only_by_a_proof_that_was_computed_here():
    def is_proved(**changes):
        return Verdict.read({**VERDICT, "proof": {**PROOF, **changes}}).is_proved

    assert is_proved(computed=True) and not is_proved(wrong_at_most=1e-9)
    assert not is_proved(computed=True, refused="it is old")


@pytest.mark.parametrize(
    ("value", "low", "high"),
    [(1.876, "1.88", "1.87"), (21.01, "21.1", "21"), (60.0, "60", "60"), (0.0, "0", "0")],
)
def test_limits_are_rounded_inwards(value, low, high):
    assert (inward(value, up=True), inward(value, up=False)) == (low, high)


@pytest.mark.parametrize(
    ("verdict", "saved", "why"),
    [
        ({}, {"shifts": None, "refused": "it is of another task"}, "it is of another task"),
        ({"good_share": 0.99}, {}, "it requires 0.9 of the oracle's success rate"),
        ({"kind": "poor"}, {}, "this verdict does not"),
    ],
)
def test_contradicting_evaluations_are_not_quoted(verdict, saved, why):
    judged = Verdict.read({**VERDICT, "kind": "good", **verdict})
    measured = SavedShifts.read({**SAVED_SHIFTS, **saved})
    assert why in measured.why_not(judged)
    finding = measured.finding(judged)
    assert finding.text.startswith("A robustness evaluation is not quoted: ")
    assert untested(find(judged, measured)) == ["colors", "light", "sizes"]


def test_findings_are_ordered_by_their_effect():
    """By hand: 40% fail; 200 of 200 unperturbed and 80 of 200 in the dark: 60%; sampled 20%."""
    measured = SavedShifts.read(SAVED_SHIFTS)
    another = Finding(text="Another ground", effect=0.5, tested=frozenset({"color"}))
    found = find(GOOD, measured, [another])
    assert [one.effect for one in found] == pytest.approx([0.6, 0.5, 0.4, 0.2])
    assert found[0].text.startswith("With brightness at 0.8 times it succeeds in 40.0%")
    assert found[0].tested == {"light", "sensor"} and found[0].section == "shifts"
    assert untested(found) == ["sizes"] and untested(found[2:]) == ["colors", "light", "sizes"]
    assert untested(find(GOOD, None)) == ["colors", "light", "sizes"]
    never = {"failures.largest": None, "failures.bound.successes": 0, "greedy.success.share": 1.0}
    spotless = Verdict.read(changed(VERDICT, {**never, "drawing": None}))
    assert [one.effect for one in find(spotless, None)] == [0.0]
