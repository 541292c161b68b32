"""Statistics of a sweep: groups of runs, medians and fractions with intervals, the summary."""

import csv
import io
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field

from drone_rl.sweeps.manifest import Run, Sweep, path_argument
from drone_rl.sweeps.rows import OLDER_RULE, Array, Row
from drone_rl.trust.rule import KINDS
from drone_rl.utils.intervals import Share, median_bounds, proportion
from drone_rl.utils.models import Model

MIN_RUNS = 6
"""Fewest runs whose median has an exact 95% interval."""
FAILED = "failed"
"""Pseudo-verdict of a failed run, in addition to `KINDS`."""
_NEVER = float("inf")


class RunShare(Share):
    """A fraction of all runs with an interval that holds whatever the unknown runs are."""

    unknown: int = 0
    """Runs that may be successes or not."""
    certain: int | None = None
    """Successes with a certain verdict."""


class RunMedian(Model):
    """A median over runs with its exact interval, which allows for censored values."""

    median: float | None
    """None for no runs, or if at least half are censored."""
    more_than: float | None
    """Then a lower bound of the median."""
    lower95: float | None
    """None for fewer than `MIN_RUNS` runs."""
    upper95: float | None
    """None also if it is unbounded."""
    runs: int


class RunGroup(Model):
    """Runs that differ in their seed only."""

    settings: dict[str, str]
    """Their values of the swept settings."""
    runs: int
    ended: int
    """Runs that are not unfinished: the denominator of fractions."""
    failed: int
    damaged: int
    unfinished: int
    judged: int
    solved: RunShare
    """Runs that reached their target; failed runs did not."""
    frames_to_solve: RunMedian
    seconds_to_solve: RunMedian
    final_share: RunMedian
    entropy: RunMedian
    verdicts: dict[str, RunShare]
    """Fraction of each of `KINDS`, and of failures, among the ended runs. A run without a verdict
    may be of any kind, a damaged one may also be a failure."""
    rows: Annotated[tuple[Row, ...], Field(exclude=True)]

    @property
    def finished(self) -> list[Row]:
        """Runs with a result."""
        return [row for row in self.rows if row.state == "finished"]

    @property
    def with_progress(self) -> list[Row]:
        """Runs that finished or failed."""
        return [row for row in self.rows if row.state in ("finished", "failed")]

    @property
    def readable(self) -> int:
        """Number of ended runs with readable files."""
        return self.ended - self.damaged


class Best(Row):
    """The run that reaches most goals."""

    judging_episodes: int
    """Episodes that selected it."""
    command: str
    """The shell command that repeats the run."""
    report_command: str
    """The command that judges it in other environments."""


class Summary(Model):
    """A sweep: the content of `summary.json`."""

    command: str
    """The command that began it."""
    judge_command: str
    """The command that judges its runs by the current rule."""
    finished: int
    failed: int
    damaged: int
    unfinished: int
    judged: int
    """Runs with a verdict by the current rule."""
    certain: int
    """Those with a certain one."""
    judged_by_older_rule: int
    never_judged: int
    error_rates: list[float]
    """Error probabilities of the verdicts, ascending."""
    episodes: list[int]
    """Numbers of episodes of the verdicts, ascending."""
    sides_not_offered: int
    """Judged runs without goals on a side."""
    best: Best | None
    """None if no run was judged."""
    groups: tuple[RunGroup, ...]
    runs: tuple[Row, ...]


def summarise_sweep(sweep: Sweep, rows: Sequence[Row]) -> Summary:
    """Return all figures of a sweep."""
    states = [row.state for row in rows]
    judged = [row.judged for row in rows if row.judged is not None]
    older = sum(row.verdict == OLDER_RULE for row in rows)
    folder = f"folder={_path_argument(sweep.folder)}"
    judge_arguments = (folder, "judge=true", *_plugins(sweep.runs))
    return Summary(
        command=sweep.command,
        judge_command=shlex.join(["drone-rl", "sweep-report", *judge_arguments]),
        finished=states.count("finished"),
        failed=states.count("failed"),
        damaged=states.count("damaged"),
        unfinished=states.count("unfinished"),
        judged=len(judged),
        certain=sum(verdict.certain for verdict in judged),
        judged_by_older_rule=older,
        never_judged=states.count("finished") - len(judged) - older,
        error_rates=sorted({verdict.error_rate for verdict in judged}),
        episodes=sorted({verdict.greedy.episodes for verdict in judged}),
        sides_not_offered=sum(row.lean is None for row in rows if row.judged is not None),
        best=_best(sweep, rows),
        groups=tuple(make_groups(rows)),
        runs=tuple(rows),
    )


def _plugins(runs: Sequence[Run]) -> list[str]:
    """Return the override that imports the modules of a sweep's runs, if they have any."""
    overrides = (o for run in runs for o in run.overrides if o.lstrip("+").startswith("plugins="))
    return list(overrides)[:1]


def _best(sweep: Sweep, rows: Sequence[Row]) -> Best | None:
    best = min(rows, key=_rank, default=None)
    if best is None or best.judged is None:
        return None
    policy = f"policy={_path_argument(sweep.folder / best.folder)}"
    run = next(run for run in sweep.runs if run.number == best.run)
    return Best(
        **dict(best),
        judging_episodes=best.judged.greedy.episodes,
        report_command=shlex.join(["drone-rl", "verdict", policy, *_plugins([run])]),
    )


def _rank(row: Row) -> tuple[bool, float, float]:
    """Rank judged runs by the fraction of goals reached, then by the fewest frames.

    Fractions make tasks with different numbers of goals comparable.
    """
    return row.judged is None, -(row.share or 0.0), row.frames


def to_csv(rows: Sequence[Row]) -> str:
    """Return the table of runs as CSV."""
    text = io.StringIO()
    plain = [
        {"run": row.run, **row.settings, **row.model_dump(exclude={"run", "settings"})}
        for row in rows
    ]
    writer = csv.DictWriter(text, fieldnames=list(plain[0]) if plain else [])
    writer.writeheader()
    writer.writerows(plain)
    return text.getvalue()


def _path_argument(path: Path) -> str:
    """Return a path for Hydra's command line, relative if it is below the current folder."""
    here = Path.cwd()
    return path_argument(path.relative_to(here) if path.is_relative_to(here) else path)


def make_groups(rows: Sequence[Row]) -> list[RunGroup]:
    """Group runs that differ in their seed only, in the order of their first run."""
    groups: dict[tuple, list[Row]] = {}
    for row in rows:
        settings = tuple((k, v) for k, v in row.settings.items() if k != "seed")
        groups.setdefault(settings, []).append(row)
    return [_group(dict(settings), some) for settings, some in groups.items()]


def _group(settings: dict[str, str], rows: Sequence[Row]) -> RunGroup:
    states = [row.state for row in rows]
    failed, damaged, unfinished = map(states.count, ("failed", "damaged", "unfinished"))
    readable = [row for row in rows if row.state in ("finished", "failed")]
    judged = [row for row in rows if row.kind is not None]
    entropies = [row.entropy for row in rows if row.entropy is not None and row.state != "failed"]
    ended = len(rows) - unfinished
    by_kind = {kind: [row for row in judged if row.kind == kind] for kind in KINDS}
    unknown = ended - len(judged) - failed
    verdicts = {
        kind: share_of_runs(len(some), unknown, ended, sum(bool(row.certain) for row in some))
        for kind, some in by_kind.items()
    }
    return RunGroup(
        settings=settings,
        runs=len(rows),
        ended=ended,
        failed=failed,
        damaged=damaged,
        unfinished=unfinished,
        judged=len(judged),
        solved=share_of_runs(sum(row.is_solved for row in rows), damaged, ended),
        frames_to_solve=_to_solve(readable, [row.frames for row in readable]),
        seconds_to_solve=_to_solve(readable, [row.seconds for row in readable]),
        final_share=median_of_runs([row.final_share for row in readable]),
        entropy=median_of_runs(entropies),
        verdicts={**verdicts, FAILED: share_of_runs(failed, damaged, ended, failed)},
        rows=tuple(rows),
    )


def _to_solve(rows: Sequence[Row], used: Sequence[float]) -> RunMedian:
    """Return the median cost to solve; an unsolved run needs more than it used (censored)."""
    pairs = zip(rows, used, strict=True)
    return median_of_runs([value if row.is_solved else _NEVER for row, value in pairs], used)


def share_of_runs(
    successes: int, unknown: int, trials: int, certain: int | None = None
) -> RunShare:
    """Return the fraction of successes; see `RunShare`."""
    upper = proportion(successes + unknown, trials).upper95
    share = dict(proportion(successes, trials)) | {"upper95": upper}
    return RunShare(**share, unknown=unknown, certain=certain)


def median_of_runs(values: Sequence[float], used: Sequence[float] | None = None) -> RunMedian:
    """Return the median over runs, one value each.

    A censored run, which ended without reaching its target, has the value infinity; what it used
    until then (`used`) is a lower bound.
    """
    least = values if used is None else used
    middle = float(np.median(values)) if len(values) else None
    low, high = median_bounds(least), median_bounds(values)
    return RunMedian(
        median=middle if middle is not None and np.isfinite(middle) else None,
        more_than=float(np.median(least)) if middle == _NEVER else None,
        lower95=None if low is None else low[0],
        upper95=None if high is None or not np.isfinite(high[1]) else high[1],
        runs=len(values),
    )


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
