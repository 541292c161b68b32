"""The runs of a sweep as rows, and the runs that differ in their seed alone as groups."""

import csv
import dataclasses
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from drone_rl.sweeps.manifest import Sweep
from drone_rl.sweeps.runs import Run, read_failure, read_result
from drone_rl.sweeps.statistics import Array, bootstrap_band, interquartile_mean
from drone_rl.utils.intervals import proportion
from drone_rl.verdicts.kinds import KINDS, Kind

SEED = "seed"
LAST_UPDATES = 20
"""Updates at the end of a run over which the entropy is averaged."""


@dataclasses.dataclass
class Row:
    """What is known of one run."""

    run: Run
    choice: dict[str, str]
    """The swept settings and their values, the seed included."""
    state: str
    """"finished", "failed", "damaged" or "unfinished"."""
    error: str | None = None
    """Why it failed or is damaged."""
    result: dict[str, Any] = dataclasses.field(default_factory=dict)
    """`result.json`."""
    curve: tuple[Array, Array] = (np.empty(0), np.empty(0))
    """Frames, and the running mean as a share of the task's cubes. Shape: (num_updates,) each."""

    entropy: float | None = None
    """Mean entropy of the policy over the last updates, nats; 0 if it can't change any more."""

    @property
    def is_solved(self) -> bool:
        """Whether it reached the target."""
        return self.result.get("reason") == "solved"

    @property
    def evaluation(self) -> dict[str, Any] | None:
        """The figures of its held-out episodes, if any were flown."""
        judged = self.result.get("verdict")
        return None if judged is None else judged["greedy"]

    @property
    def verdict(self) -> str | None:
        """One of `KINDS`; None without an evaluation."""
        judged = self.result.get("verdict")
        return None if judged is None else Kind(judged["kind"]).family

    @property
    def lean(self) -> float | None:
        """Share of the cubes on the right that it collected minus that on the left."""
        sides = {} if self.evaluation is None else self.evaluation["shares"]
        left, right = (sides.get(side, {}).get("mean") for side in ("left", "right"))
        return None if left is None or right is None else right - left

    @property
    def final_share(self) -> float:
        """The running mean at the end, as a share of the task's cubes."""
        return self.result["running_cubes"] / self.result["num_cubes"]

    def plain(self) -> dict[str, Any]:
        """One row of the table."""
        evaluation = self.evaluation or {}
        sides = evaluation.get("shares", {})
        figures = {key: self.result.get(key) for key in ("reason", "frames", "episodes")}
        return {
            "run": self.run.number,
            **self.choice,
            "state": self.state,
            "verdict": self.verdict,
            **figures,
            "seconds": round(self.result["seconds"], 1) if self.result else None,
            "running_cubes": self.result.get("running_cubes"),
            "mean_cubes": evaluation.get("mean_cubes"),
            "all_cubes": evaluation.get("success", {}).get("share"),
            **{side: sides.get(side, {}).get("mean") for side in ("left", "ahead", "right")},
            "entropy": self.entropy,
            "error": self.error,
            "folder": self.run.folder.name,
        }


@dataclasses.dataclass
class Group:
    """Runs that differ in their seed alone."""

    choice: dict[str, str]
    """Their common values of the swept settings."""
    rows: list[Row]
    """All of them."""

    @property
    def finished(self) -> list[Row]:
        """Those with a result."""
        return [row for row in self.rows if row.state == "finished"]

    @property
    def verdicts(self) -> dict[str, dict[str, Any]]:
        """Share of each of `KINDS` among the judged, with exact intervals."""
        judged = [row.verdict for row in self.finished if row.verdict is not None]
        return {kind: proportion(judged.count(kind), len(judged)) for kind in KINDS}

    def plain(self) -> dict[str, Any]:
        """Its figures, shares with exact and means with bootstrap intervals."""
        solved = [row.result for row in self.finished if row.is_solved]
        return {
            **self.choice,
            "runs": len(self.rows),
            "finished": len(self.finished),
            "solved": proportion(len(solved), len(self.finished)),
            "median_frames_to_solve": _median([r["frames"] for r in solved]),
            "median_seconds_to_solve": _median([r["seconds"] for r in solved]),
            "median_entropy": _median([r.entropy for r in self.finished if r.entropy is not None]),
            "final_share": _mean_with_band([row.final_share for row in self.finished]),
            "verdicts": self.verdicts,
        }


def read_rows(sweep: Sweep) -> list[Row]:
    """One row for every run, whatever has become of it."""
    choices = [_choice(run) for run in sweep.runs]
    keys = list(dict.fromkeys(key for choice in choices for key in choice))
    swept = [key for key in keys if len({choice.get(key) for choice in choices}) > 1]
    return [
        _read_row(run, {key: choice.get(key, "") for key in swept})
        for run, choice in zip(sweep.runs, choices, strict=True)
    ]


def make_groups(rows: Sequence[Row]) -> list[Group]:
    """The groups, in the order of their first run."""
    groups: dict[tuple, Group] = {}
    for row in rows:
        choice = {key: value for key, value in row.choice.items() if key != SEED}
        groups.setdefault(tuple(choice.items()), Group(choice, [])).rows.append(row)
    return list(groups.values())


def best_row(rows: Sequence[Row]) -> Row | None:
    """The run with most cubes in its held-out episodes, of equals the one soonest done."""
    finished = [row for row in rows if row.state == "finished"]

    def merit(row: Row) -> tuple[float, float]:
        cubes = row.result["running_cubes"]
        return (row.evaluation["mean_cubes"] if row.evaluation else cubes, -row.result["frames"])

    return max(finished, key=merit, default=None)


def to_csv(rows: Sequence[Row]) -> str:
    """The table of runs."""
    text = io.StringIO()
    plain = [row.plain() for row in rows]
    writer = csv.DictWriter(text, fieldnames=list(plain[0]) if plain else [])
    writer.writeheader()
    writer.writerows(plain)
    return text.getvalue()


def _choice(run: Run) -> dict[str, str]:
    parts = (override.partition("=") for override in run.overrides)
    return {key.lstrip("+"): value for key, _, value in parts if key != "trial"}


def _read_row(run: Run, choice: dict[str, str]) -> Row:
    result = read_result(run.folder)
    if result is None:
        error = read_failure(run)
        return Row(run, choice, "unfinished" if error is None else "failed", error)
    try:
        row = Row(run, choice, "finished", None, result, *_read_metrics(run.folder, result))
        row.plain()
    except (OSError, ValueError, KeyError, TypeError) as error:
        return Row(run, choice, "damaged", f"its files can't be read ({error!r})")
    return row


def _read_metrics(folder: Path, result: dict[str, Any]) -> tuple[tuple[Array, Array], float | None]:
    """The learning curve, and the entropy at its end."""
    with (folder / "metrics.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    frames = np.array([float(row["frames"]) for row in rows])
    cubes = np.array([float(row["train/running_cubes"]) for row in rows])
    last = [float(row["loss/entropy"]) for row in rows[-LAST_UPDATES:] if row.get("loss/entropy")]
    return (frames, cubes / result["num_cubes"]), float(np.mean(last)) if last else None


def _median(values: Sequence[float]) -> float | None:
    return float(np.median(values)) if values else None


def _mean_with_band(values: Sequence[float]) -> dict[str, float] | None:
    if not values:
        return None
    column = np.array(values)[:, None]
    lower, upper = bootstrap_band(column)
    mean = interquartile_mean(column)
    return {"iqm": float(mean[0]), "lower95": float(lower[0]), "upper95": float(upper[0])}
