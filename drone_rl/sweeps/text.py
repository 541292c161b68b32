"""What a sweep's page, and its lines in a terminal, may say; made of its `summary.json`."""

from drone_rl.sweeps import figures_text as sweep_figures
from drone_rl.sweeps.counts import FEWEST, censored, count, ended, few, from_to, in_words, solved
from drone_rl.utils.text import Evidence, Sentence, percent

_OF_THE_RUNS = (
    Sentence(
        "runs.counts",
        "always",
        lambda e: True,
        lambda e: (
            f"{in_words(count(e))}: {e['finished']} finished, {e['failed']} failed, "
            f"{e['damaged']} damaged, {e['unfinished']} unfinished."
        ),
    ),
    Sentence(
        "runs.read",
        "a run has ended",
        lambda e: ended(e) > 0,
        lambda e: (
            f"All figures of {in_words(ended(e))} were read from files in their folders and not "
            "measured again."
        ),
    ),
    Sentence(
        "runs.failed",
        "a run failed",
        lambda e: e["failed"] > 0,
        lambda e: (
            f"Shares are of all runs that ended: {in_words(e['failed'])} that failed count as not "
            "solved, as having learned nothing, and among the verdicts as failed."
        ),
    ),
    Sentence(
        "runs.damaged",
        "a run's files can't be read",
        lambda e: e["damaged"] > 0,
        lambda e: (
            f"The files of {in_words(e['damaged'])} can't be read: intervals of shares allow for "
            "anything that these may have been; medians and curves leave them out."
        ),
    ),
    Sentence(
        "runs.copies",
        "runs have the same figures, measured seconds included",
        lambda e: e["copies"] > 0,
        lambda e: (
            f"{in_words(e['copies'])} with exactly the figures of another run, seconds included: "
            "probably copies of one training, which count more than once."
        ),
    ),
    Sentence(
        "runs.unfinished",
        "a run has not ended",
        lambda e: e["unfinished"] > 0,
        lambda e: f"{in_words(e['unfinished'])} not ended yet: left out of every share and median.",
    ),
    Sentence(
        "runs.solved_none",
        "runs ended and none was solved",
        lambda e: ended(e) > 0 and solved(e) == 0,
        lambda e: "No run was stopped by reaching its target.",
    ),
    Sentence(
        "runs.few",
        f"a setting has some ended runs, but fewer than {FEWEST}",
        lambda e: few(e) > 0,
        lambda e: (
            f"{few(e)} of {len(e['groups'])} settings with fewer than {FEWEST} ended runs: no "
            "interval of their median holds, so that none is shown."
        ),
    ),
    Sentence(
        "runs.censored",
        "a setting of whose runs at least half never reached the target",
        lambda e: censored(e) > 0,
        lambda e: (
            f"At {censored(e)} of {len(e['groups'])} settings at least half of the runs ended "
            "without reaching the target: of the median of what it takes it is only known that it "
            "is more (>) than what they had."
        ),
    ),
)
_OF_THE_VERDICTS = (
    Sentence(
        "verdicts.basis",
        "a policy was judged",
        lambda e: e["judged"] > 0,
        lambda e: (
            f"Verdicts are on the last policies of {in_words(e['judged'])}, by "
            f"{from_to(e['episodes'])} greedy episodes each in worlds to choose by."
        ),
    ),
    Sentence(
        "verdicts.certain",
        "all verdicts are certain",
        lambda e: 0 < e["judged"] == e["certain"],
        lambda e: (
            f"All of them are certain, each with a chance of error of at most "
            f"{percent(max(e['error_rates']))}."
        ),
    ),
    Sentence(
        "verdicts.not_certain",
        "a verdict is not certain",
        lambda e: e["certain"] < e["judged"],
        lambda e: (
            f"{e['judged'] - e['certain']} of {e['judged']} verdicts are not certain (hollow "
            "dots): more episodes might change them."
        ),
    ),
    Sentence(
        "verdicts.older_rule",
        "a run has an evaluation, but no verdict by the present rule",
        lambda e: e["judged_by_older_rule"] > 0,
        lambda e: (
            f"{in_words(e['judged_by_older_rule'])} judged by an older rule: not counted; the "
            f"intervals of kinds allow for any. Judge again: `{e['judge_command']}`"
        ),
    ),
    Sentence(
        "verdicts.missing",
        "a finished run was never judged",
        lambda e: e["never_judged"] > 0,
        lambda e: (
            f"{in_words(e['never_judged'])} finished and not judged; the intervals of kinds "
            f"allow for any. Judge: `{e['judge_command']}`"
        ),
    ),
)
_OF_THE_BEST = (
    Sentence(
        "best.none",
        "no run was judged",
        lambda e: e["best"] is None,
        lambda e: "No run has been judged by the present rule, so that no best run is known.",
    ),
    Sentence(
        "best.chosen",
        "a run was judged",
        lambda e: e["best"] is not None,
        lambda e: (
            f"Run {e['best']['run']}: {e['best']['verdict']}"
            f"{'' if e['best']['certain'] else ' (not certain)'}, with "
            f"{percent(e['best']['share'])} of its cubes; chosen by {e['best']['episodes']} "
            "episodes in worlds to choose by."
        ),
    ),
    Sentence(
        "best.equals",
        "others collect the same share",
        lambda e: e["best"] is not None and e["best"]["equals"] > 0,
        lambda e: (
            f"{in_words(e['best']['equals'])} collected the same share with as many frames or more."
        ),
    ),
    Sentence(
        "best.flattered",
        "it was chosen among several",
        lambda e: e["best"] is not None and e["judged"] > 1,
        lambda e: f"The best of {e['judged']} by these figures is flattered by them.",
    ),
    Sentence(
        "best.report",
        "a run was judged",
        lambda e: e["best"] is not None,
        lambda e: f"Report it with `{e['best']['report_command']}`, which uses other worlds.",
    ),
)
_OF_THE_SETTINGS = (
    Sentence(
        "settings.intervals",
        "a run has ended",
        lambda e: ended(e) > 0,
        lambda e: (
            "Shares are of all runs that ended, with exact (Clopper-Pearson) 95% intervals; "
            f"medians have those of order statistics, from {FEWEST} runs on."
        ),
    ),
)
SENTENCES = (
    *_OF_THE_RUNS,
    *_OF_THE_VERDICTS,
    *_OF_THE_BEST,
    *sweep_figures.SENTENCES,
    *_OF_THE_SETTINGS,
)
"""What may be said of a whole sweep; the evidence is its `summary.json`."""


def _kinds(group: Evidence) -> str:
    counts = [
        f"{kind} {share['successes']}" + _of_which_certain(share)
        for kind, share in group["verdicts"].items()
    ]
    return ", ".join(counts)


def _of_which_certain(share: Evidence) -> str:
    return "" if share["certain"] == share["successes"] else f" ({share['certain']} certain)"


GROUP_SENTENCES = (
    Sentence(
        "group.none",
        "no run of the setting has ended",
        lambda g: g["ended"] == 0,
        lambda g: "no run has ended",
    ),
    Sentence(
        "group.solved",
        "a run of the setting has ended",
        lambda g: g["ended"] > 0,
        lambda g: f"solved {g['solved']['successes']} of {g['ended']}",
    ),
    Sentence(
        "group.verdicts",
        "a policy of the setting was judged",
        lambda g: g["judged"] > 0,
        lambda g: f"verdicts: {_kinds(g)}",
    ),
    Sentence(
        "group.unknown",
        "some that ended have no verdict",
        lambda g: g["ended"] > g["judged"] + g["failed"],
        lambda g: f"without verdict {g['ended'] - g['judged'] - g['failed']}",
    ),
    Sentence(
        "group.unfinished",
        "some have not ended",
        lambda g: g["ended"] > 0 and g["unfinished"] > 0,
        lambda g: f"unfinished {g['unfinished']}",
    ),
)
"""What may be said of the runs that differ in their seed alone; the evidence is one of "groups"."""
