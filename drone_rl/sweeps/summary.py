"""Statistics of a sweep: groups of runs, medians and fractions with intervals, the summary."""

import csv
import dataclasses
import io
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from drone_rl.sweeps.manifest import Run, Sweep, path_argument
from drone_rl.sweeps.rows import Array, Row
from drone_rl.sweeps.text import GROUP_SENTENCES, SENTENCES
from drone_rl.trust.rule import KINDS
from drone_rl.utils.intervals import median_bounds, proportion
from drone_rl.utils.text import said

STATES = ("finished", "failed", "damaged", "unfinished")
FAILED = "failed"
"""Pseudo-verdict of a failed run, in addition to `KINDS`."""
_NEVER = float("inf")


def summarise_sweep(sweep: Sweep, rows: Sequence[Row]) -> dict[str, Any]:
    """Return all figures of a sweep as plain values, and the sentences that they permit."""
    states = [row.state for row in rows]
    judged = [row.verdict for row in rows if row.verdict is not None]
    older = sum(row.has_older_verdict for row in rows)
    folder = f"folder={_path_argument(sweep.folder)}"
    judge_arguments = (folder, "judge=true", *_plugins(sweep.runs))
    summary = {
        "command": sweep.command,
        "judge_command": shlex.join(["drone-rl", "sweep-report", *judge_arguments]),
        **{name: states.count(name) for name in STATES},
        "judged": len(judged),
        "certain": sum(verdict["certain"] for verdict in judged),
        "judged_by_older_rule": older,
        "never_judged": states.count("finished") - len(judged) - older,
        "error_rates": sorted({verdict["error_rate"] for verdict in judged}),
        "episodes": sorted({verdict["greedy"]["episodes"] for verdict in judged}),
        "sides_not_offered": sum(row.lean is None for row in rows if row.verdict is not None),
        "best": _best(rows),
        "groups": [group.plain() for group in make_groups(rows)],
        "runs": [row.plain() for row in rows],
    }
    return {**summary, "sentences": said(SENTENCES, summary)}


def _plugins(runs: Sequence[Run]) -> list[str]:
    """Return the override that imports the modules of a sweep's runs, if they have any."""
    overrides = (o for run in runs for o in run.overrides if o.lstrip("+").startswith("plugins="))
    return list(overrides)[:1]


def _best(rows: Sequence[Row]) -> dict[str, Any] | None:
    best = min(rows, key=_rank, default=None)
    if best is None or best.verdict is None:
        return None
    policy = f"policy={_path_argument(best.run.folder)}"
    return {
        **best.plain(),
        "episodes": best.verdict["greedy"]["episodes"],
        "command": best.run.repeat_command(),
        "report_command": shlex.join(["drone-rl", "verdict", policy, *_plugins([best.run])]),
    }


def _rank(row: Row) -> tuple[bool, float, float]:
    """Rank judged runs by the fraction of goals reached, then by the fewest frames.

    Fractions make tasks with different numbers of goals comparable.
    """
    return row.verdict is None, -(row.share("all") or 0.0), row.frames


def to_csv(rows: Sequence[Row]) -> str:
    """Return the table of runs as CSV."""
    text = io.StringIO()
    plain = [row.plain() for row in rows]
    writer = csv.DictWriter(text, fieldnames=list(plain[0]) if plain else [])
    writer.writeheader()
    writer.writerows(plain)
    return text.getvalue()


def _path_argument(path: Path) -> str:
    """Return a path for Hydra's command line, relative if it is below the current folder."""
    here = Path.cwd()
    return path_argument(path.relative_to(here) if path.is_relative_to(here) else path)


@dataclasses.dataclass
class RunGroup:
    """Runs that differ in their seed only."""

    choice: dict[str, str]
    """Their values of the swept settings."""
    rows: list[Row]
    """The runs."""

    @property
    def finished(self) -> list[Row]:
        """Runs with a result."""
        return [row for row in self.rows if row.state == "finished"]

    @property
    def ended(self) -> list[Row]:
        """Runs that are not unfinished: the denominator of fractions."""
        return [row for row in self.rows if row.state != "unfinished"]

    @property
    def known(self) -> list[Row]:
        """Runs with known progress: finished or failed."""
        return [row for row in self.ended if row.state != "damaged"]

    @property
    def solved(self) -> dict[str, Any]:
        """Fraction of the ended runs that reached their target; failed runs did not."""
        hits = sum(row.is_solved for row in self.finished)
        return share_of_runs(hits, len(self.ended) - len(self.known), len(self.ended))

    @property
    def verdicts(self) -> dict[str, dict[str, Any]]:
        """Fraction of each of `KINDS`, and of failures, among the ended runs.

        A run without a verdict may be of any kind, a damaged one may also be a failure. "certain"
        counts the certain verdicts.
        """
        judged = [row for row in self.finished if row.kind is not None]
        failed = len(self.known) - len(self.finished)
        unknown = len(self.ended) - len(judged) - failed
        shares = {}
        for kind in KINDS:
            rows = [row for row in judged if row.kind == kind]
            shares[kind] = share_of_runs(len(rows), unknown, len(self.ended))
            shares[kind]["certain"] = sum(row.is_certain for row in rows)
        damaged = len(self.ended) - len(self.known)
        failures = share_of_runs(failed, damaged, len(self.ended))
        return {**shares, FAILED: {**failures, "certain": failed}}

    def plain(self) -> dict[str, Any]:
        """Return counts, fractions and medians with exact intervals, and their sentences."""
        known_runs, states = self.known, [row.state for row in self.rows]
        figures = {
            **self.choice,
            "runs": len(self.rows),
            "ended": len(self.ended),
            **{name: states.count(name) for name in ("failed", "damaged", "unfinished")},
            "judged": sum(row.kind is not None for row in self.finished),
            "solved": self.solved,
            "frames_to_solve": _to_solve(known_runs, [row.frames for row in known_runs]),
            "seconds_to_solve": _to_solve(known_runs, [row.seconds for row in known_runs]),
            "final_share": median_of_runs([row.final_share for row in known_runs]),
            "entropy": median_of_runs([r.entropy for r in self.finished if r.entropy is not None]),
            "verdicts": self.verdicts,
        }
        return {**figures, "sentences": said(GROUP_SENTENCES, figures)}


def make_groups(rows: Sequence[Row]) -> list[RunGroup]:
    """RunGroup runs that differ in their seed only, in the order of their first run."""
    groups: dict[tuple, RunGroup] = {}
    for row in rows:
        choice = {key: value for key, value in row.choice.items() if key != "seed"}
        groups.setdefault(tuple(choice.items()), RunGroup(choice, [])).rows.append(row)
    return list(groups.values())


def _to_solve(rows: Sequence[Row], used: Sequence[float]) -> dict[str, Any]:
    """Return the median cost to solve; an unsolved run needs more than it used (censored)."""
    pairs = zip(rows, used, strict=True)
    return median_of_runs([value if row.is_solved else _NEVER for row, value in pairs], used)


def share_of_runs(successes: int, unknown: int, trials: int) -> dict[str, Any]:
    """Return a fraction of all runs with an interval that holds whatever the unknown runs are.

    The unknown runs may all be successes, or none. The result is that of `proportion`, with
    "unknown".
    """
    upper = proportion(successes + unknown, trials).upper95
    return {**dict(proportion(successes, trials)), "upper95": upper, "unknown": unknown}


def median_of_runs(values: Sequence[float], used: Sequence[float] | None = None) -> dict[str, Any]:
    """Return the median over runs with its exact interval, allowing for censored values.

    There is one value per run, infinite for a censored one, which ended without reaching its
    target; what it used until then (`used`) is a lower bound.

    Returns:
        "median" (None for no runs, or if at least half are censored), "more_than" (then a lower
        bound), "lower95" and "upper95" (None for fewer than six runs; "upper95" also if it is
        unbounded) and "runs".
    """
    least = values if used is None else used
    middle = float(np.median(values)) if len(values) else None
    low, high = median_bounds(least), median_bounds(values)
    return {
        "median": middle if middle is not None and np.isfinite(middle) else None,
        "more_than": float(np.median(least)) if middle == float("inf") else None,
        "lower95": None if low is None else low[0],
        "upper95": None if high is None or not np.isfinite(high[1]) else high[1],
        "runs": len(values),
    }


def median_band(values: Array) -> tuple[Array, Array] | None:
    """Return the pointwise exact interval of the median of values, a row per run.

    Lower and upper bounds have shape (num_points,) each; None for fewer than six runs.
    """
    bounds = [median_bounds(column) for column in np.asarray(values, float).T]
    existing = [pair for pair in bounds if pair is not None]
    if not existing:
        return None
    lower, upper = np.array(existing).T
    return lower, upper


def on_grid(x: Array, y: Array, grid: Array) -> Array:
    """Interpolate a curve on a grid; it is 0 before its first point and constant after its last.

    Positions `x` ascend; they are empty for a run without progress. Shapes: (n,) of both.
    """
    return np.interp(grid, x, y, left=0.0) if len(x) else np.zeros_like(grid)
