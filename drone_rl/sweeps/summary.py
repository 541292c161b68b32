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
from drone_rl.sweeps.rows import Array, Row
from drone_rl.trust.rule import KINDS
from drone_rl.utils.intervals import Share, median_bounds, proportion
from drone_rl.utils.models import Model

MIN_RUNS = 6
"""Fewest runs whose median has an exact 95% interval."""
FAILED = "failed"
"""Pseudo-verdict of a failed run, in addition to `KINDS`."""
_NEVER = float("inf")


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
    failed: int
    unfinished: int
    judged: int
    solved: Share
    """Of the runs that ended; failed runs did not reach their target."""
    frames_to_solve: RunMedian
    seconds_to_solve: RunMedian
    final_share: RunMedian
    entropy: RunMedian
    verdicts: dict[str, Share]
    """Fraction of each of `KINDS`, and of failures, among the runs that were judged or failed."""
    rows: Annotated[tuple[Row, ...], Field(exclude=True)]

    @property
    def ended(self) -> list[Row]:
        """Runs that finished or failed."""
        return [row for row in self.rows if row.state != "unfinished"]


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
    unfinished: int
    judged: int
    """Runs with a verdict by the current rule."""
    certain: int
    """Those with a certain one."""
    error_rates: list[float]
    """Error probabilities of the verdicts, ascending."""
    episodes: list[int]
    """Numbers of episodes of the verdicts, ascending."""
    best: Best | None
    """None if no run was judged."""
    groups: tuple[RunGroup, ...]
    runs: tuple[Row, ...]


def summarise_sweep(sweep: Sweep, rows: Sequence[Row]) -> Summary:
    """Return all figures of a sweep."""
    states = [row.state for row in rows]
    judged = [row.judged for row in rows if row.judged is not None]
    folder = f"folder={_path_argument(sweep.folder)}"
    judge_arguments = (folder, "judge=true", *_plugins(sweep.runs))
    return Summary(
        command=sweep.command,
        judge_command=shlex.join(["drone-rl", "sweep-report", *judge_arguments]),
        finished=states.count("finished"),
        failed=states.count("failed"),
        unfinished=states.count("unfinished"),
        judged=len(judged),
        certain=sum(verdict.certain for verdict in judged),
        error_rates=sorted({verdict.error_rate for verdict in judged}),
        episodes=sorted({verdict.greedy.episodes for verdict in judged}),
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
    failed = [row for row in rows if row.state == "failed"]
    ended = [row for row in rows if row.state != "unfinished"]
    kinds = [row.kind for row in rows if row.kind is not None] + [FAILED] * len(failed)
    entropies = [row.entropy for row in rows if row.entropy is not None and row.state != "failed"]
    return RunGroup(
        settings=settings,
        runs=len(rows),
        failed=len(failed),
        unfinished=len(rows) - len(ended),
        judged=len(kinds) - len(failed),
        solved=proportion(sum(row.is_solved for row in rows), len(ended)),
        frames_to_solve=_to_solve(ended, [row.frames for row in ended]),
        seconds_to_solve=_to_solve(ended, [row.seconds for row in ended]),
        final_share=median_of_runs([row.final_share for row in ended]),
        entropy=median_of_runs(entropies),
        verdicts={k: proportion(kinds.count(k), len(kinds)) for k in (*KINDS, FAILED)},
        rows=tuple(rows),
    )


def _to_solve(rows: Sequence[Row], used: Sequence[float]) -> RunMedian:
    """Return the median cost to solve; an unsolved run needs more than it used (censored)."""
    pairs = zip(rows, used, strict=True)
    return median_of_runs([value if row.is_solved else _NEVER for row, value in pairs], used)


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
