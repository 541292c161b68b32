"""The sentences of a sweep's page and terminal lines; the evidence is its `summary.json`."""

from collections.abc import Callable

from drone_rl.utils.text import Evidence, Sentence, percent, plural

MIN_RUNS = 6
"""Fewest runs whose median has an exact 95% interval."""


def from_to(values: list) -> str:
    """Return the range of sorted numbers."""
    return f"{values[0]}" if len(values) == 1 else f"{values[0]} to {values[-1]}"


def readable(group: Evidence) -> int:
    """Count the ended runs of a setting with readable files."""
    return group["ended"] - group["damaged"]


def counts(summary: Evidence) -> dict[str, int]:
    """Return numbers of runs and settings.

    "few": settings with readable runs, but too few for an interval of the median; "censored":
    settings of which at least half of the runs never reached the target; "entropies": judged runs
    with a known final entropy.
    """
    runs, groups = summary["runs"], summary["groups"]
    solved = sum(group["solved"]["successes"] for group in groups)
    return {
        "ended": len(runs) - summary["unfinished"],
        "solved": solved,
        "unsolved": summary["finished"] + summary["failed"] - solved,
        "few": sum(0 < readable(group) < MIN_RUNS for group in groups),
        "censored": sum(group["frames_to_solve"]["more_than"] is not None for group in groups),
        "entropies": sum(r["certain"] is not None and r["entropy"] is not None for r in runs),
    }


def _if_any(
    name: str, condition: str, number: str | Callable[[Evidence], int], text: str
) -> Sentence:
    """Return a sentence that is included if a number is positive.

    The number is an entry of the evidence or one of `counts`. The text formats {e}, the evidence;
    {n}, the number; {runs}, such as "3 runs"; and {settings}, the number of settings.
    """

    def count(e: Evidence) -> int:
        if not isinstance(number, str):
            return number(e)
        return e[number] if number in e else counts(e)[number]

    def fill(e: Evidence) -> str:
        n, settings = count(e), len(e.get("groups", ()))
        return text.format(e=e, n=n, runs=plural(n, "run"), settings=settings)

    return Sentence(name, condition, lambda e: count(e) > 0, fill)


SENTENCES = (
    Sentence(
        "runs.counts",
        "always",
        lambda e: True,
        lambda e: (
            f"{plural(len(e['runs']), 'run')}: {e['finished']} finished, {e['failed']} failed, "
            f"{e['damaged']} damaged, {e['unfinished']} unfinished."
        ),
    ),
    _if_any(
        "runs.read",
        "a run has ended",
        "ended",
        "All figures of {runs} were read from files in their folders and not measured again.",
    ),
    _if_any(
        "runs.failed",
        "a run failed",
        "failed",
        "Fractions are of all runs that ended: {runs} that failed count as not solved, as having "
        "learned nothing, and among the verdicts as failed.",
    ),
    _if_any(
        "runs.damaged",
        "a run's files can't be read",
        "damaged",
        "The files of {runs} can't be read: intervals of fractions allow for any outcome of these; "
        "medians and curves leave them out.",
    ),
    _if_any(
        "runs.unfinished",
        "a run has not ended",
        "unfinished",
        "{runs} not ended yet: left out of every fraction and median.",
    ),
    _if_any(
        "runs.few",
        f"a setting has some readable ended runs, but fewer than {MIN_RUNS}",
        "few",
        f"{{n}} of {{settings}} settings with fewer than {MIN_RUNS} readable ended runs: their "
        "medians have no valid interval, so that none is shown.",
    ),
    _if_any(
        "runs.censored",
        "a setting of whose runs at least half never reached the target",
        "censored",
        "At {n} of {settings} settings at least half of the runs ended without reaching the "
        "target: the median cost to solve is greater (>) than the value shown.",
    ),
    Sentence(
        "verdicts.basis",
        "a policy was judged",
        lambda e: e["judged"] > 0,
        lambda e: (
            f"Verdicts are on the last policies of {plural(e['judged'], 'run')}, by "
            f"{from_to(e['episodes'])} greedy episodes each in selection environments."
        ),
    ),
    Sentence(
        "verdicts.certain",
        "all verdicts are certain",
        lambda e: 0 < e["judged"] == e["certain"],
        lambda e: (
            f"All of them are certain, each with an error probability of at most "
            f"{100 * max(e['error_rates']):g}%."
        ),
    ),
    _if_any(
        "verdicts.not_certain",
        "a verdict is not certain",
        lambda e: e["judged"] - e["certain"],
        "{n} of {e[judged]} verdicts are not certain (hollow dots): more episodes might change "
        "them.",
    ),
    _if_any(
        "verdicts.older_rule",
        "a run has an evaluation, but no verdict by the present rule",
        "judged_by_older_rule",
        "{runs} judged by an older rule: not counted; the intervals of verdicts allow for any "
        "verdict of these runs. Judge again: `{e[judge_command]}`",
    ),
    _if_any(
        "verdicts.missing",
        "a finished run was never judged",
        "never_judged",
        "{runs} finished and not judged; the intervals of verdicts allow for any verdict of these "
        "runs. Judge: `{e[judge_command]}`",
    ),
    _if_any(
        "best.none",
        "no run was judged",
        lambda e: e["best"] is None,
        "No run has been judged by the present rule, so that no best run is known.",
    ),
    Sentence(
        "best.chosen",
        "a run was judged",
        lambda e: e["best"] is not None,
        lambda e: (
            f"Run {e['best']['run']}: {e['best']['verdict']}"
            f"{'' if e['best']['certain'] else ' (not certain)'}, which reaches "
            f"{percent(e['best']['share'])} of its goals; selected by {e['best']['episodes']} "
            "episodes in selection environments."
        ),
    ),
    _if_any(
        "best.flattered",
        "it was chosen among several",
        lambda e: e["best"] is not None and e["judged"] > 1,
        "These figures are optimistic, since they selected the best of {e[judged]} runs.",
    ),
    _if_any(
        "best.report",
        "a run was judged",
        lambda e: e["best"] is not None,
        "Report it with `{e[best][report_command]}`, which uses other environments.",
    ),
    _if_any(
        "curves.band",
        f"a setting with {MIN_RUNS} readable ended runs or more",
        lambda e: any(readable(group) >= MIN_RUNS for group in e["groups"]),
        "Thick line: the median over runs; band: its exact pointwise 95% interval by order "
        "statistics. The curve of a finished run is extended by its last value.",
    ),
    _if_any(
        "curves.runs",
        f"a setting with fewer than {MIN_RUNS} readable ended runs",
        "few",
        f"Thin lines: single runs, where fewer than {MIN_RUNS} have ended with readable files.",
    ),
    Sentence(
        "shares.bars",
        "a policy was judged",
        lambda e: e["judged"] > 0,
        lambda e: (
            f"Fraction of all {counts(e)['ended']} runs that ended; bars: exact 95% "
            "(Clopper-Pearson) intervals over runs."
        ),
    ),
    _if_any(
        "sides.dots",
        "a policy was offered goals on both sides",
        lambda e: e["judged"] - e["sides_not_offered"],
        "Each dot is a judged run: the fraction of the goals on its right that it reaches, minus "
        "the fraction of those on its left.",
    ),
    _if_any(
        "sides.not_offered",
        "a policy was offered no goal on a side",
        "sides_not_offered",
        "{runs} without a dot: a side had no goals, or the task does not count goals by side.",
    ),
    _if_any(
        "entropies.dots",
        "a judged run has an entropy",
        "entropies",
        "Each dot is a judged run: the mean entropy of its policy over the last updates. If "
        "all are from 0 to ln 3, a line marks ln 3, that of three equally probable actions.",
    ),
    _if_any(
        "costs.dots",
        "a run was solved",
        "solved",
        "Each dot is a run that reached its target.",
    ),
    _if_any(
        "costs.open",
        "a run ended without reaching its target",
        "unsolved",
        "Each open triangle is a run that ended without reaching its target (red: failed): it "
        "needs more than the value shown.",
    ),
    _if_any(
        "settings.intervals",
        "a run has ended",
        "ended",
        "Fractions are of all runs that ended, with exact (Clopper-Pearson) 95% intervals; "
        f"medians of at least {MIN_RUNS} runs have intervals by order statistics.",
    ),
)
"""The sentences on a whole sweep."""


def _kinds(group: Evidence) -> str:
    return ", ".join(
        f"{kind} {share['successes']}"
        + ("" if share["certain"] == share["successes"] else f" ({share['certain']} certain)")
        for kind, share in group["verdicts"].items()
    )


GROUP_SENTENCES = (
    _if_any(
        "group.none",
        "no run of the setting has ended",
        lambda g: g["ended"] == 0,
        "no run has ended",
    ),
    _if_any(
        "group.solved",
        "a run of the setting has ended",
        "ended",
        "solved {e[solved][successes]} of {n}",
    ),
    Sentence(
        "group.verdicts",
        "a policy of the setting was judged",
        lambda g: g["judged"] > 0,
        lambda g: f"verdicts: {_kinds(g)}",
    ),
    _if_any(
        "group.unknown",
        "some that ended have no verdict",
        lambda g: g["ended"] - g["judged"] - g["failed"],
        "without verdict {n}",
    ),
    _if_any(
        "group.damaged",
        "the files of some can't be read",
        "damaged",
        "not readable {n}",
    ),
    _if_any(
        "group.unfinished",
        "some have not ended",
        lambda g: g["unfinished"] if g["ended"] > 0 else 0,
        "unfinished {n}",
    ),
)
"""The sentences on one of "groups" in the summary."""
