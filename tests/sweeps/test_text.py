"""Each sentence of a sweep is said of the evidence that allows it, and of no other."""

import copy

import pytest

from drone_rl.sweeps.text import GROUP_SENTENCES, SENTENCES
from drone_rl.utils.text import said

SHARE = {"successes": 1, "trials": 1, "certain": 1}
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
BEST = {"run": 3, "verdict": "good", "certain": True, "share": 0.999, "episodes": 200, "equals": 0}
SWEEP = {
    "finished": 6,
    "failed": 0,
    "copies": 0,
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
SAID = {
    "runs.counts": "6 runs: 6 finished, 0 failed, 0 damaged, 0 unfinished.",
    "runs.read": "All figures of 6 runs were read from files in their folders",
    "verdicts.basis": "of 6 runs, by 200 greedy episodes each in selection environments",
    "verdicts.certain": "error probability of at most 5%",
    "best.chosen": "Run 3: good, which reaches 99.9% of its goals; selected by 200 episodes in",
    "best.flattered": "best of 6 runs",
    "best.report": "`report`, which uses other environments",
    "curves.band": "median over runs",
    "curves.ends": "extended by its last value",
    "shares.bars": "all 6 runs that ended",
    "sides.dots": "dot",
    "entropies.dots": "dot",
    "costs.dots": "reached its target",
    "costs.open": "needs more than the value",
    "settings.intervals": "Fractions are of all runs that ended",
}
"""Part of each sentence that is said of this sweep."""


def changed(**evidence):
    return {**copy.deepcopy(SWEEP), **evidence}


def with_group(**evidence):
    return changed(groups=[{**GROUP, **evidence}])


def with_run(**evidence):
    return changed(runs=[{**RUN, **evidence}, *[RUN] * 5])


def test_nothing_else_is_said_of_a_sweep_where_all_went_well():
    found = said(SENTENCES, SWEEP)
    assert set(found) == set(SAID)
    for name, part in SAID.items():
        assert part in found[name]


@pytest.mark.parametrize(
    ("name", "evidence", "part"),
    [
        ("runs.counts", changed(failed=2, finished=4), "4 finished, 2 failed"),
        ("runs.failed", changed(failed=1), "1 run that failed"),
        ("runs.damaged", changed(damaged=2), "2 runs can't be read"),
        ("runs.copies", changed(copies=2), "2 runs with exactly the figures"),
        ("runs.unfinished", changed(unfinished=1), "1 run not ended yet"),
        ("runs.solved_none", with_group(solved={"successes": 0}), "No run"),
        ("runs.few", with_group(ended=5), "1 of 1 settings with fewer than 6"),
        ("runs.few", with_group(damaged=1), "1 of 1 settings with fewer than 6"),
        ("runs.censored", with_group(frames_to_solve={"more_than": 9.0}), "At 1 of 1 settings"),
        ("verdicts.basis", changed(episodes=[100, 200]), "100 to 200"),
        ("verdicts.not_certain", changed(certain=4), "2 of 6 verdicts are not certain"),
        ("verdicts.older_rule", changed(judged_by_older_rule=2), "not counted"),
        ("verdicts.missing", changed(never_judged=1), "`judge`"),
        ("best.none", changed(best=None), "No run has been judged"),
        ("best.chosen", changed(best={**SWEEP["best"], "certain": False}), "good (not certain)"),
        ("best.equals", changed(best={**SWEEP["best"], "equals": 2}), "2 runs reached the same"),
        ("curves.runs", with_group(ended=3), "fewer than 6 have ended"),
        ("curves.failed", changed(failed=1), "learned nothing"),
        ("sides.lost_left", with_run(verdict="one-sided (right)"), "1 run one-sided to the right"),
        ("sides.lost_right", with_run(verdict="one-sided (left)"), "1 run one-sided to the left"),
        ("sides.not_offered", changed(sides_not_offered=1), "a side had no goals"),
        ("entropies.still", with_run(entropy=0.009), "1 run ended below 0.01 nats"),
    ],
)
def test_evidence_makes_a_sentence(name, evidence, part):
    found = said(SENTENCES, evidence)
    assert part in found[name]
    assert found[name] != said(SENTENCES, SWEEP).get(name)


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
        ("curves.ends", changed(finished=0, failed=6)),
        ("shares.bars", changed(judged=0, certain=0)),
        ("sides.dots", changed(sides_not_offered=6)),
        ("entropies.dots", changed(runs=[{**RUN, "certain": None}] * 6)),
        ("entropies.still", with_run(entropy=0.001, state="failed")),
        ("costs.dots", with_group(solved={"successes": 0})),
        ("costs.open", with_group(solved={"successes": 6})),
        ("settings.intervals", changed(unfinished=6)),
        ("runs.few", with_group(ended=0)),
        ("runs.solved_none", with_group(solved={"successes": 1})),
    ],
)
def test_without_its_evidence_a_sentence_goes(name, evidence):
    assert name not in said(SENTENCES, evidence)


def test_a_group_in_a_line():
    assert said(GROUP_SENTENCES, GROUP) == {
        "group.solved": "solved 5 of 6",
        "group.verdicts": "verdicts: good 6",
    }
    half = {"good": {"successes": 2, "certain": 1}, "failed": {"successes": 1, "certain": 1}}
    mixed = {**GROUP, "judged": 2, "failed": 1, "unfinished": 4, "verdicts": half}
    found = said(GROUP_SENTENCES, mixed)
    assert found["group.verdicts"] == "verdicts: good 2 (1 certain), failed 1"
    assert found["group.unknown"] == "without verdict 3"
    assert found["group.unfinished"] == "unfinished 4"
    assert said(GROUP_SENTENCES, {**GROUP, "ended": 0, "judged": 0, "unfinished": 6}) == {
        "group.none": "no run has ended"
    }


def test_names_are_unique_and_licences_are_told():
    names = [sentence.name for sentence in (*SENTENCES, *GROUP_SENTENCES)]
    assert len(set(names)) == len(names)
    assert all(sentence.condition for sentence in SENTENCES)


def test_runs_that_can_not_be_read_are_not_called_unsolved():
    group = {**GROUP, "ended": 3, "damaged": 2, "judged": 0, "solved": {"successes": 0}}
    found = said(SENTENCES, changed(damaged=2, groups=[group]))["runs.solved_none"]
    assert found == "No run with readable files was stopped by reaching its target."
    assert said(GROUP_SENTENCES, group)["group.damaged"] == "not readable 2"
