"""The sentences of a sweep's page and terminal lines; the evidence is its `summary.json`."""

from drone_rl.utils.text import Evidence, Sentence, percent

FEWEST = 6
"""Fewest runs whose median has an exact 95% interval."""
STILL = 0.01
"""Entropy in nats below which a policy is practically deterministic."""


def in_words(number: int) -> str:
    """Return "1 run" or "3 runs"."""
    return "1 run" if number == 1 else f"{number} runs"


def from_to(values: list) -> str:
    """Return the range of sorted numbers."""
    return f"{values[0]}" if len(values) == 1 else f"{values[0]} to {values[-1]}"


def count(summary: Evidence) -> int:
    """Count all runs."""
    return len(summary["runs"])


def readable(group: Evidence) -> int:
    """Count the ended runs of a setting with readable files."""
    return group["ended"] - group["damaged"]


def few(summary: Evidence) -> int:
    """Count the settings with readable runs, but too few for an interval of the median."""
    return sum(0 < readable(group) < FEWEST for group in summary["groups"])


def censored(summary: Evidence) -> int:
    """Count the settings of which at least half of the runs never reached the target."""
    return sum(group["frames_to_solve"]["more_than"] is not None for group in summary["groups"])


def solved(summary: Evidence) -> int:
    """Count the runs that reached their target."""
    return sum(group["solved"]["successes"] for group in summary["groups"])


def ended(summary: Evidence) -> int:
    """Count the runs that are finished, failed or damaged."""
    return count(summary) - summary["unfinished"]


def unsolved(summary: Evidence) -> int:
    """Count the runs that ended without reaching their target."""
    return summary["finished"] + summary["failed"] - solved(summary)


def one_sided(summary: Evidence, kept: str) -> int:
    """Count the runs with a policy that collects on one side only, "left" or "right"."""
    return sum(run["verdict"] == f"one-sided ({kept})" for run in summary["runs"])


def still(summary: Evidence) -> int:
    """Count the finished runs with a practically deterministic policy."""
    runs = [run for run in summary["runs"] if run["state"] == "finished"]
    return sum(run["entropy"] is not None and run["entropy"] < STILL for run in runs)


def entropies(summary: Evidence) -> int:
    """Count the judged runs with a known final entropy."""
    judged = [run for run in summary["runs"] if run["certain"] is not None]
    return sum(run["entropy"] is not None for run in judged)


_RUNS = (
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
            f"Fractions are of all runs that ended: {in_words(e['failed'])} that failed count as "
            "not solved, as having learned nothing, and among the verdicts as failed."
        ),
    ),
    Sentence(
        "runs.damaged",
        "a run's files can't be read",
        lambda e: e["damaged"] > 0,
        lambda e: (
            f"The files of {in_words(e['damaged'])} can't be read: intervals of fractions allow "
            "for any outcome of these; medians and curves leave them out."
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
        lambda e: (
            f"{in_words(e['unfinished'])} not ended yet: left out of every fraction and median."
        ),
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
            f"{few(e)} of {len(e['groups'])} settings with fewer than {FEWEST} ended runs: their "
            "medians have no valid interval, so that none is shown."
        ),
    ),
    Sentence(
        "runs.censored",
        "a setting of whose runs at least half never reached the target",
        lambda e: censored(e) > 0,
        lambda e: (
            f"At {censored(e)} of {len(e['groups'])} settings at least half of the runs ended "
            "without reaching the target: the median cost to solve is greater (>) than the value "
            "shown."
        ),
    ),
)
_VERDICTS = (
    Sentence(
        "verdicts.basis",
        "a policy was judged",
        lambda e: e["judged"] > 0,
        lambda e: (
            f"Verdicts are on the last policies of {in_words(e['judged'])}, by "
            f"{from_to(e['episodes'])} greedy episodes each in selection environments."
        ),
    ),
    Sentence(
        "verdicts.certain",
        "all verdicts are certain",
        lambda e: 0 < e["judged"] == e["certain"],
        lambda e: (
            f"All of them are certain, each with an error probability of at most "
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
_BEST = (
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
            f"{percent(e['best']['share'])} of its cubes; selected by {e['best']['episodes']} "
            "episodes in selection environments."
        ),
    ),
    Sentence(
        "best.equals",
        "others collect the same share",
        lambda e: e["best"] is not None and e["best"]["equals"] > 0,
        lambda e: (
            f"{in_words(e['best']['equals'])} collected the same fraction with at least as many "
            "frames."
        ),
    ),
    Sentence(
        "best.flattered",
        "it was chosen among several",
        lambda e: e["best"] is not None and e["judged"] > 1,
        lambda e: (
            f"These figures are optimistic, since they selected the best of {e['judged']} runs."
        ),
    ),
    Sentence(
        "best.report",
        "a run was judged",
        lambda e: e["best"] is not None,
        lambda e: f"Report it with `{e['best']['report_command']}`, which uses other environments.",
    ),
)
_FIGURES = (
    Sentence(
        "curves.band",
        f"a setting with {FEWEST} ended runs or more",
        lambda e: any(readable(group) >= FEWEST for group in e["groups"]),
        lambda e: (
            "Thick line: the median over runs; band: its exact pointwise 95% interval by order "
            "statistics."
        ),
    ),
    Sentence(
        "curves.runs",
        f"a setting with fewer than {FEWEST} ended runs",
        lambda e: few(e) > 0,
        lambda e: f"Thin lines: single runs, where fewer than {FEWEST} have ended.",
    ),
    Sentence(
        "curves.ends",
        "a run has finished",
        lambda e: e["finished"] > 0,
        lambda e: "The curve of a finished run is extended by its last value.",
    ),
    Sentence(
        "curves.failed",
        "a run failed",
        lambda e: e["failed"] > 0,
        lambda e: "A failed run counts as having learned nothing.",
    ),
    Sentence(
        "shares.bars",
        "a policy was judged",
        lambda e: e["judged"] > 0,
        lambda e: (
            f"Fraction of all {ended(e)} runs that ended; bars: exact 95% (Clopper-Pearson) "
            "intervals over runs."
        ),
    ),
    Sentence(
        "sides.dots",
        "a policy was offered cubes on both sides",
        lambda e: e["judged"] > e["sides_not_offered"],
        lambda e: (
            "Each dot is a judged run: the fraction of the cubes on its right that it collects, "
            "minus the fraction of those on its left."
        ),
    ),
    Sentence(
        "sides.lost_left",
        "a policy is one-sided to the right",
        lambda e: one_sided(e, "right") > 0,
        lambda e: f"{in_words(one_sided(e, 'right'))} one-sided to the right.",
    ),
    Sentence(
        "sides.lost_right",
        "a policy is one-sided to the left",
        lambda e: one_sided(e, "left") > 0,
        lambda e: f"{in_words(one_sided(e, 'left'))} one-sided to the left.",
    ),
    Sentence(
        "sides.not_offered",
        "a policy was offered no cube on a side",
        lambda e: e["sides_not_offered"] > 0,
        lambda e: f"{in_words(e['sides_not_offered'])} without a dot: one side had no cubes.",
    ),
    Sentence(
        "entropies.dots",
        "a judged run has an entropy",
        lambda e: entropies(e) > 0,
        lambda e: (
            "Each dot is a judged run: the mean entropy of its policy over the last updates; the "
            "line is that of three actions of the same probability."
        ),
    ),
    Sentence(
        "entropies.still",
        f"a finished run ended below {STILL} nats",
        lambda e: still(e) > 0,
        lambda e: (
            f"{in_words(still(e))} ended below {STILL} nats: these policies are practically "
            "deterministic."
        ),
    ),
    Sentence(
        "costs.dots",
        "a run was solved",
        lambda e: solved(e) > 0,
        lambda e: (
            "Each dot is a run that reached its target; above: their number, of the runs that "
            "ended."
        ),
    ),
    Sentence(
        "costs.open",
        "a run ended without reaching its target",
        lambda e: unsolved(e) > 0,
        lambda e: (
            "Each open triangle is a run that ended without (red: failed): it needs more than that."
        ),
    ),
)
_SETTINGS = (
    Sentence(
        "settings.intervals",
        "a run has ended",
        lambda e: ended(e) > 0,
        lambda e: (
            "Fractions are of all runs that ended, with exact (Clopper-Pearson) 95% intervals; "
            f"medians of at least {FEWEST} runs have intervals by order statistics."
        ),
    ),
)
SENTENCES = (*_RUNS, *_VERDICTS, *_BEST, *_FIGURES, *_SETTINGS)
"""The sentences on a whole sweep."""


def _kinds(group: Evidence) -> str:
    return ", ".join(
        f"{kind} {share['successes']}"
        + ("" if share["certain"] == share["successes"] else f" ({share['certain']} certain)")
        for kind, share in group["verdicts"].items()
    )


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
"""The sentences on one of "groups" in the summary."""
