"""Each sentence of a sweep is written for the evidence that permits it, and for no other."""

import copy

import pytest

from drone_rl.sweeps.text import GROUP_SENTENCES, SENTENCES, counts, from_to, readable
from drone_rl.utils.text import said

GROUP = {
    "ended": 6,
    "failed": 0,
    "damaged": 0,
    "unfinished": 0,
    "judged": 6,
    "solved": {"successes": 5},
    "frames_to_solve": {"more_than": None},
    "verdicts": {"good": {"successes": 6, "certain": 6}},
}
RUN = {"state": "finished", "verdict": "good", "certain": True, "entropy": 0.5}
BEST = {"run": 3, "verdict": "good", "certain": True, "share": 0.999, "episodes": 200}
SWEEP = {
    "finished": 6,
    "failed": 0,
    "damaged": 0,
    "unfinished": 0,
    "judged": 6,
    "certain": 6,
    "judged_by_older_rule": 0,
    "never_judged": 0,
    "judge_command": "judge",
    "error_rates": [0.05],
    "episodes": [200],
    "sides_not_offered": 0,
    "best": {**BEST, "report_command": "report"},
    "groups": [GROUP],
    "runs": [RUN] * 6,
}


def changed(**evidence):
    return {**copy.deepcopy(SWEEP), **evidence}


def with_group(**evidence):
    return changed(groups=[{**GROUP, **evidence}])


def test_sentences_about_a_sweep_of_good_runs():
    assert {name.partition(".")[0] for name in said(SENTENCES, SWEEP)} == {
        *("runs", "verdicts", "best", "curves", "shares", "sides", "entropies", "costs"),
        "settings",
    }
    assert said(SENTENCES, SWEEP)["best.chosen"].startswith("Run 3: good, which reaches 99.9%")


@pytest.mark.parametrize(
    ("name", "evidence"),
    [
        ("runs.failed", changed(failed=1)),
        ("runs.damaged", changed(damaged=2)),
        ("runs.unfinished", changed(unfinished=1)),
        ("runs.few", with_group(ended=5)),
        ("runs.few", with_group(damaged=1)),
        ("runs.censored", with_group(frames_to_solve={"more_than": 9.0})),
        ("verdicts.not_certain", changed(certain=4)),
        ("verdicts.older_rule", changed(judged_by_older_rule=2)),
        ("verdicts.missing", changed(never_judged=1)),
        ("best.none", changed(best=None)),
        ("curves.runs", with_group(ended=3)),
        ("sides.not_offered", changed(sides_not_offered=1)),
    ],
)
def test_evidence_makes_a_sentence(name, evidence):
    assert name in said(SENTENCES, evidence) and name not in said(SENTENCES, SWEEP)


@pytest.mark.parametrize(
    ("name", "evidence"),
    [
        ("verdicts.basis", changed(judged=0, certain=0)),
        ("verdicts.certain", changed(certain=5)),
        ("verdicts.certain", changed(judged=0, certain=0)),
        ("best.chosen", changed(best=None)),
        ("best.report", changed(best=None)),
        ("best.flattered", changed(judged=1, certain=1)),
        ("curves.band", with_group(ended=5)),
        ("curves.band", with_group(damaged=1)),
        ("shares.bars", changed(judged=0, certain=0)),
        ("sides.dots", changed(sides_not_offered=6)),
        ("entropies.dots", changed(runs=[{**RUN, "certain": None}] * 6)),
        ("costs.dots", with_group(solved={"successes": 0})),
        ("costs.open", with_group(solved={"successes": 6})),
        ("settings.intervals", changed(unfinished=6)),
        ("runs.few", with_group(ended=0)),
    ],
)
def test_a_sentence_without_its_evidence_is_left_out(name, evidence):
    assert name not in said(SENTENCES, evidence)


def test_a_group_in_a_line():
    assert said(GROUP_SENTENCES, GROUP) == {
        "group.solved": "solved 5 of 6",
        "group.verdicts": "verdicts: good 6",
    }
    half = {"good": {"successes": 2, "certain": 1}, "failed": {"successes": 1, "certain": 1}}
    mixed = {**GROUP, "judged": 2, "failed": 1, "damaged": 1, "unfinished": 4, "verdicts": half}
    assert said(GROUP_SENTENCES, mixed) == {
        "group.solved": "solved 5 of 6",
        "group.verdicts": "verdicts: good 2 (1 certain), failed 1",
        "group.unknown": "without verdict 3",
        "group.damaged": "not readable 1",
        "group.unfinished": "unfinished 4",
    }
    assert said(GROUP_SENTENCES, {**GROUP, "ended": 0, "judged": 0, "unfinished": 6}) == {
        "group.none": "no run has ended"
    }


def test_counts_by_hand():
    groups = [
        {**GROUP, "ended": 7, "damaged": 1, "solved": {"successes": 3}},
        {**GROUP, "damaged": 1, "solved": {"successes": 0}, "frames_to_solve": {"more_than": 9.0}},
        {**GROUP, "ended": 0, "solved": {"successes": 0}},
    ]
    runs = [RUN, {**RUN, "entropy": None}, *[{**RUN, "certain": None}] * 5]
    summary = changed(finished=4, failed=1, unfinished=2, groups=groups, runs=runs)
    assert counts(summary) == {
        "ended": 5,  # 7 runs, 2 of them unfinished
        "solved": 3,
        "unsolved": 2,  # 4 + 1 that ended, 3 solved
        "few": 1,  # 6 - 1 damaged is fewer than 6; a setting without ended runs is not counted
        "censored": 1,
        "entropies": 1,
    }
    assert [readable(group) for group in groups] == [6, 5, 0]
    assert (from_to([200]), from_to([100, 150, 200])) == ("200", "100 to 200")
