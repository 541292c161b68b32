"""The table of runs: one row per run, read from its files whatever its state."""

import contextlib
import itertools
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drone_rl.sweeps.manifest import Run, Sweep, read_failure, read_sweep
from drone_rl.trust.results import Verdict
from drone_rl.trust.rule import SIDES, Rule
from drone_rl.utils.errors import InputError
from drone_rl.utils.models import Model
from drone_rl.utils.readers import read_table
from drone_rl.utils.run_result import OwnVerdict, RunResult

Array = NDArray[np.float64]
LAST_UPDATES = 20
"""Number of last updates over which the entropy is averaged."""
_DAMAGE = (ValueError, LookupError, TypeError)
"""Exceptions that reading damaged files raises; `InputError` is a `ValueError`."""


class Row(Model):
    """One run."""

    run: int
    """Its number."""
    settings: dict[str, str]
    """The swept settings and their values, including the seed."""
    state: Literal["finished", "failed", "unfinished"] = "unfinished"
    """A run whose files can't be read failed, too."""
    verdict: str | None = None
    """Kind of the last policy by the current rule; None if it was not judged by that."""
    certain: bool | None = None
    """Whether the verdict is statistically certain."""
    reason: str | None = None
    """Why the training ended."""
    frames: int = 0
    """Frames until it ended or failed."""
    episodes: int | None = None
    seconds: float = 0.0
    """Training time until it ended or failed."""
    running_reward: float | None = None
    success: float | None = None
    """Success rate of the greedy policy."""
    share: float | None = None
    """Fraction of goals that it reaches."""
    left: float | None = None
    """The same of goals on its left; None without such goals, as in a task with other strata."""
    ahead: float | None = None
    right: float | None = None
    entropy: float | None = None
    """Mean entropy of the policy over the last updates, nats."""
    error: str | None = None
    """Reason of a failure."""
    folder: str
    """Path of the run's folder inside the sweep's folder."""
    command: Annotated[str, Field(exclude=True)]
    """The shell command that repeats the run."""
    final_share: Annotated[float, Field(exclude=True)] = 0.0
    """Final running mean as a fraction of the greatest reward, or itself if that is not known; 0 if
    the run failed."""
    judged: Annotated[Verdict | None, Field(exclude=True)] = None
    """The verdict by the current rule."""
    curve: Annotated[tuple[Any, Any], Field(exclude=True)] = (np.empty(0), np.empty(0))
    """Learning curve: frames, and running mean as a fraction of the greatest reward; empty unless
    the run finished. A failed run counts as having learned nothing. Shape: (num_updates,) each."""

    @property
    def is_solved(self) -> bool:
        """Whether it reached the target, or was proved to succeed in all cases."""
        return self.reason in ("solved", "proved")

    @property
    def kind(self) -> str | None:
        """One of `KINDS`, without sides; None without a verdict."""
        return None if self.judged is None else self.judged.kind.family

    @property
    def lean(self) -> float | None:
        """Fraction of the goals reached on the right minus that on the left."""
        return None if self.left is None or self.right is None else self.right - self.left


def read_rows(sweep: Sweep) -> list[Row]:
    """Read one row for each run."""
    choices = [_choice(run) for run in sweep.runs]
    keys = list(dict.fromkeys(key for choice in choices for key in choice))
    swept = [key for key in keys if len({choice.get(key) for choice in choices}) > 1]
    return [
        _read_row(run, {key: choice.get(key, "") for key in swept}, sweep.name_of(run))
        for run, choice in zip(sweep.runs, choices, strict=True)
    ]


def _choice(run: Run) -> dict[str, str]:
    parts = (override.partition("=") for override in run.overrides)
    return {key.lstrip("+"): value for key, _, value in parts if key != "trial"}


def _read_row(run: Run, settings: dict[str, str], folder: str) -> Row:
    command = run.repeat_command()
    row = Row(run=run.number, settings=settings, folder=folder, command=command)
    try:
        result = RunResult.of(run.folder)
        if result is None:
            return _read_unfinished(row, run)
        progress, curve = _read_metrics(run.folder)
        judged = _read_verdict(result.verdict)
    except _DAMAGE as damage:
        return row.replace(state="failed", error=f"its files can't be read ({damage})")
    reward, most = result.running_reward, result.largest_reward or 1.0
    shared = {"reason", "frames", "episodes", "seconds", "running_reward"}
    return row.replace(
        state="finished",
        **progress | result.model_dump(include=shared),
        curve=(curve[0], curve[1] / most),
        final_share=reward / most,
    ).replace(**{} if judged is None else _figures_of(judged))


def _read_unfinished(row: Row, run: Run) -> Row:
    """Return the row of a run without a result, which has failed or is unfinished."""
    error, progress = read_failure(run), {}
    if error is None:
        return row
    with contextlib.suppress(*_DAMAGE):  # a failed run may have metrics
        progress, _ = _read_metrics(run.folder)
    return row.replace(state="failed", error=error, **progress)


def _read_verdict(verdict: OwnVerdict | None) -> Verdict | None:
    """Return the verdict if it is by the current rule."""
    if verdict is None or verdict.rule != Rule().text:
        return None
    return Verdict.read(dict(verdict), "result.verdict")


def _figures_of(judged: Verdict) -> dict[str, Any]:
    shares = {name: share.mean for name, share in judged.greedy.shares.items()}
    return {
        "judged": judged,
        "verdict": judged.kind.value,
        "certain": judged.certain,
        "success": judged.greedy.success.share,
        "share": shares["all"],
        **{side: shares.get(side) for side in SIDES},
    }


def _read_metrics(folder: Path) -> tuple[dict[str, Any], tuple[Array, Array]]:
    """Return the last figures, and frames and running reward of each update."""
    header, *lines = read_table(folder / "metrics.csv")
    if not {"frames", "train/running_reward"} <= {*header}:
        raise InputError("metrics.csv lacks the columns frames and train/running_reward")
    cells = itertools.zip_longest(*lines, fillvalue="") if lines else itertools.repeat(())
    columns = dict(zip(header, cells, strict=False))
    curve = tuple(np.array(columns[n], float) for n in ("frames", "train/running_reward"))
    logged = [float(cell) for cell in columns.get("loss/entropy", ())[-LAST_UPDATES:] if cell]
    entropy = float(np.mean(logged)) if logged else np.nan
    progress: dict[str, Any] = {"entropy": entropy if np.isfinite(entropy) else None}
    if lines:
        progress |= {"frames": int(curve[0][-1]), "seconds": float(columns["seconds"][-1])}
    return progress, (curve[0], curve[1])


def choice_in_sweep(checkpoint: Path) -> tuple[str, dict[str, Any]] | None:
    """Return the command that repeats a checkpoint's run, and how it was chosen in its sweep.

    That is "runs", the number of runs in the sweep, and "episodes", the number by which it was
    judged there. None if it is no checkpoint of a sweep's run.
    """
    folder = checkpoint.absolute().parent.parent
    if checkpoint.suffix != ".pt" or not (folder.parent / "sweep.json").is_file():
        return None
    sweep = read_sweep(folder.parent)
    for run, row in zip(sweep.runs, read_rows(sweep), strict=True):
        if run.folder == folder:
            episodes = None if row.judged is None else row.judged.greedy.episodes
            return row.command, {"runs": len(sweep.runs), "episodes": episodes}
    return None
