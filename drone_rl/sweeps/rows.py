"""The table of runs: one row per run, read from its files whatever its state."""

import contextlib
import dataclasses
import itertools
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drone_rl.sweeps.manifest import Run, Sweep, read_failure, read_sweep
from drone_rl.trust.rule import SIDES, Rule, VerdictKind
from drone_rl.utils.errors import InputError
from drone_rl.utils.readers import read_result, read_table
from drone_rl.utils.schema import Flag, Maybe, OneOf, Real, Whole

Array = NDArray[np.float64]
LAST_UPDATES = 20
"""Number of last updates over which the entropy is averaged."""
NOT_OFFERED = "not offered"
"""Placeholder for the fraction of goals reached on a side without goals."""


@dataclasses.dataclass
class Row:
    """One run."""

    run: Run
    choice: dict[str, str]
    """The swept settings and their values, including the seed."""
    folder: str
    """Path of the run's folder inside the sweep's folder."""
    state: str = "unfinished"
    """"finished", "failed", "damaged" or "unfinished"."""
    error: str | None = None
    """Reason of a failure or damage."""
    result: dict[str, Any] = dataclasses.field(default_factory=dict)
    """`result.json`."""
    curve: tuple[Array, Array] = (np.empty(0), np.empty(0))
    """Learning curve: frames, and running mean as a fraction of the greatest reward; empty unless
    the run finished. A failed run counts as having learned nothing. Shape: (num_updates,) each."""
    frames: float = 0.0
    """Frames until it ended or failed."""
    seconds: float = 0.0
    """Training time until it ended or failed."""
    entropy: float | None = None
    """Mean entropy of the policy over the last updates, nats."""

    @property
    def is_solved(self) -> bool:
        """Whether it reached the target, or was proved to succeed in all cases."""
        return self.result.get("reason") in ("solved", "proved")

    @property
    def verdict(self) -> dict[str, Any] | None:
        """Verdict on the last policy by the current rule, or None."""
        verdict = self.result.get("verdict")
        return verdict if verdict is not None and verdict["rule"] == Rule().text else None

    @property
    def kind(self) -> str | None:
        """One of `KINDS`, without sides; None without a verdict."""
        return None if self.verdict is None else VerdictKind(self.verdict["kind"]).family

    @property
    def is_certain(self) -> bool:
        """Whether the verdict is statistically certain."""
        return self.verdict is not None and self.verdict["certain"]

    @property
    def has_older_verdict(self) -> bool:
        """Whether the run was judged by an outdated rule only."""
        return "verdict" in self.result and self.verdict is None

    @property
    def lean(self) -> float | None:
        """Fraction of the goals reached on the right minus that on the left."""
        left, right = self.share("left"), self.share("right")
        return None if left is None or right is None else right - left

    @property
    def final_share(self) -> float:
        """Final running mean as a fraction of the greatest reward; 0 if the run failed."""
        return self.result["running_reward"] / self.result["largest_reward"] if self.result else 0.0

    def share(self, of: str) -> float | None:
        """Return the fraction of goals that the greedy policy reaches: cubes, or rows of pillars.

        `of` is "all", "left", "ahead" or "right". None without a verdict, or without such goals, as
        in a task with other strata.
        """
        shares = {} if self.verdict is None else self.verdict["greedy"]["shares"]
        return shares[of]["mean"] if of in shares else None

    def plain(self) -> dict[str, Any]:
        """Return the row as plain values."""
        verdict, judged = self.verdict, self.verdict is not None
        sides = {side: self.share(side) for side in SIDES}
        return {
            "run": self.run.number,
            **self.choice,
            "state": self.state,
            "verdict": verdict["kind"] if verdict else self._why_not_judged(),
            "certain": self.is_certain if judged else None,
            **{key: self.result.get(key) for key in ("reason", "frames", "episodes")},
            "seconds": round(self.result["seconds"], 1) if self.result else None,
            "running_reward": self.result.get("running_reward"),
            "success": verdict["greedy"]["success"]["share"] if verdict else None,
            "share": self.share("all"),
            **{k: NOT_OFFERED if judged and v is None else v for k, v in sides.items()},
            "entropy": self.entropy,
            "error": self.error,
            "folder": self.folder,
        }

    def _why_not_judged(self) -> str | None:
        if self.has_older_verdict:
            return "judged by an older rule: not counted"
        return "not judged" if self.state == "finished" else None


def read_rows(sweep: Sweep) -> list[Row]:
    """Read one row for each run."""
    choices = [_choice(run) for run in sweep.runs]
    keys = list(dict.fromkeys(key for choice in choices for key in choice))
    swept = [key for key in keys if len({choice.get(key) for choice in choices}) > 1]
    return [
        _read_row(Row(run, {key: choice.get(key, "") for key in swept}, sweep.name_of(run)))
        for run, choice in zip(sweep.runs, choices, strict=True)
    ]


def _choice(run: Run) -> dict[str, str]:
    parts = (override.partition("=") for override in run.overrides)
    return {key.lstrip("+"): value for key, _, value in parts if key != "trial"}


def _read_row(row: Row) -> Row:
    """Add to a row what the run's files contain."""
    result, row.error = read_result(row.run.folder), read_failure(row.run)
    if result is None:
        if row.error is not None:
            row.state = "failed"
            with contextlib.suppress(*_DAMAGE):  # a failed run may have metrics
                _read_metrics(row)
        return row
    try:
        _check_result(result)
        frames, rewards = _read_metrics(row)
    except _DAMAGE as error:
        reason = str(error) if isinstance(error, InputError) else repr(error)
        row.state, row.error = "damaged", f"its files can't be read ({reason})"
        return row
    row.state, row.error, row.result = "finished", None, result
    row.curve = frames, rewards / result["largest_reward"]
    row.frames, row.seconds = float(result["frames"]), float(result["seconds"])
    return row


_DAMAGE = (ValueError, LookupError, TypeError, AttributeError)
"""Exceptions that reading damaged files raises; `InputError` is a `ValueError`."""
_KIND = OneOf(tuple(kind.value for kind in VerdictKind))
_RESULT = {
    "frames": Whole(0, 10**15),
    "episodes": Whole(0, 10**12),
    "seconds": Real(0.0, 1e10),
    "largest_reward": Real(0.0, 1e6, is_above=True),
    "running_reward": Real(-1e15, 1e15),
}
"""Schema of the figures in `result.json`."""


def _check_result(result: dict[str, Any]) -> None:
    for key, kind in _RESULT.items():
        kind.read(result.get(key), f"result.{key}")
    verdict = result.get("verdict")
    if verdict is not None and verdict["rule"] == Rule().text:
        _KIND.read(verdict["kind"], "verdict.kind")
        Flag().read(verdict["certain"], "verdict.certain")
        for of in verdict["greedy"]["shares"].values():
            Maybe(Real(0.0, 1.0)).read(of["mean"], "verdict.greedy.shares")


def _read_metrics(row: Row) -> tuple[Array, Array]:
    """Return frames and running reward of each update; add final figures to the row."""
    header, *lines = read_table(row.run.folder / "metrics.csv")
    if not {"frames", "train/running_reward"} <= {*header}:
        raise InputError("metrics.csv lacks the columns frames and train/running_reward")
    cells = itertools.zip_longest(*lines, fillvalue="") if lines else itertools.repeat(())
    columns = dict(zip(header, cells, strict=False))
    frames = np.array(columns["frames"], np.float64)
    rewards = np.array(columns["train/running_reward"], np.float64)
    if lines:
        row.frames, row.seconds = float(frames[-1]), float(columns["seconds"][-1])
    logged = [float(cell) for cell in columns.get("loss/entropy", ())[-LAST_UPDATES:] if cell]
    entropy = float(np.mean(logged)) if logged else np.nan
    row.entropy = entropy if np.isfinite(entropy) else None
    return frames, rewards


def choice_in_sweep(checkpoint: Path) -> tuple[str, dict[str, Any]] | None:
    """Return the command that repeats a checkpoint's run, and how it was chosen in its sweep.

    That is "runs", the number of runs in the sweep, and "episodes", the number by which it was
    judged there. None if it is no checkpoint of a sweep's run.
    """
    folder = checkpoint.absolute().parent.parent
    if checkpoint.suffix != ".pt" or not (folder.parent / "sweep.json").is_file():
        return None
    rows = read_rows(read_sweep(folder.parent))
    row = next((row for row in rows if row.run.folder == folder), None)
    if row is None:
        return None
    episodes = None if row.verdict is None else row.verdict["greedy"]["episodes"]
    return row.run.repeat_command(), {"runs": len(rows), "episodes": episodes}
