"""`drone-rl plot`: learning curves of any runs. Runs that differ only in the seed are one curve."""

import re
import textwrap
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure

from drone_rl.config import TASKS
from drone_rl.sim.tasks import as_task
from drone_rl.sweeps.rows import Array
from drone_rl.sweeps.summary import on_grid
from drone_rl.training.metrics import success_metric
from drone_rl.trust.plots.saving import new_chart
from drone_rl.utils.errors import InputError
from drone_rl.utils.overrides import read_overrides
from drone_rl.utils.plugins import errors_of
from drone_rl.utils.readers import read_metrics, read_yaml

WINDOW = 100
"""Last episodes of each success rate."""
_REWARD, _SUCCESS = "running reward", f"success rate of the last {WINDOW} episodes"
_BAND = "line: median over seeds; band: lowest to highest; a run that ended keeps its last value"


class RunCurves(NamedTuple):
    """What a plot takes from the folder of a run."""

    folder: Path
    settings: str
    """All training settings but the seed."""
    typed: set[str]
    """Overrides on its command line that may describe it."""
    x: Array
    """Frames or seconds until each update. Shape: (num_updates,)."""
    y: dict[str, Array]
    """Running reward, and success rate if it was logged, by label. Shapes: (num_updates,)."""


def plot_curves(folders: Iterable[str | Path], x: str = "frames") -> Figure:
    """Return learning curves: the median over seeds, and a band from lowest to highest.

    Args:
        folders: Folders of runs, or of sweeps and others that contain runs.
        x: "frames" or "seconds".

    Raises:
        InputError: A folder contains no metrics.csv, or a file is damaged.
    """
    groups: dict[str, list[RunCurves]] = {}
    for folder in folders:
        files = sorted(Path(folder).glob("**/metrics.csv"))
        runs = [run for file in files if len((run := read_run(file.parent, x)).x)]
        if not runs:
            raise InputError(
                f"{folder} contains no metrics.csv of updates; give folders of runs or sweeps"
            )
        for run in runs:
            groups.setdefault(run.settings, []).append(run)
    return _draw([*groups.values()], x)


def read_run(folder: Path, x: str) -> RunCurves:
    """Read the curves and settings of a run; see `plot_curves` for errors."""
    with errors_of(f"runs={folder}", "metrics.csv or run.yaml"):
        columns = {name: np.array(values) for name, values in read_metrics(folder).items()}
        y = {_REWARD: columns["train/running_reward"]}
        for task in map(as_task, TASKS):
            rates = columns.get(success_metric(task))
            if rates is not None:
                y[_SUCCESS] = success_rates(columns["episodes"], rates)
        settings = read_yaml(folder / "run.yaml")["config"] | {"seed": None}
        typed = {
            o for o in read_overrides(folder) if not o.startswith(("seed=", "trial=", "logger="))
        }
        return RunCurves(folder, str(settings), typed, columns[x], y)


def success_rates(episodes: Array, rates: Array) -> Array:
    """Return the success rate of the last `WINDOW` episodes, or of all if there are fewer.

    Args:
        episodes: Episodes until each update. Shape: (num_updates,).
        rates: Success rate of the episodes of each update; NaN without any. Same shape.

    Returns:
        The rate after each update, 0 before the first episode. Same shape.
    """
    ended = np.array([0, *episodes])
    succeeded = np.cumsum([0, *np.nan_to_num(rates * np.diff(ended))])
    before = np.interp(episodes - WINDOW, ended, succeeded)
    return (succeeded[1:] - before) / np.clip(episodes, 1, WINDOW)


def _draw(groups: Sequence[Sequence[RunCurves]], x: str) -> Figure:
    """Draw a curve for each group, named by the overrides that all its runs, but not all, have."""
    runs = [run for group in groups for run in group]
    shared = set.intersection(*(run.typed for run in runs))
    y = _SUCCESS if all(_SUCCESS in run.y for run in runs) else _REWARD
    figure, axes = new_chart(8, 4 + 0.2 * len(groups))
    ends = []
    for group, color in zip(
        groups, colormaps["turbo"](np.linspace(0.1, 0.9, len(groups))), strict=True
    ):
        own = sorted(set.intersection(*(run.typed for run in group)) - shared)
        name = ", ".join(map(_words, own)) or group[0].folder
        grid = np.unique(np.concatenate([run.x for run in group]))
        ends.append(grid[-1])
        values = np.stack([on_grid(run.x, run.y[y], grid) for run in group])
        label = textwrap.fill(f"{name} (runs: {len(group)})", 80)
        axes.plot(grid, np.median(values, 0), color=color, label=label)
        axes.fill_between(grid, values.min(0), values.max(0), color=color, alpha=0.2)
    scale = "log" if max(ends) > 10 * min(ends) else "linear"
    axes.set(xlabel=x, ylabel=y, xscale=scale, title=_BAND)
    figure.legend(loc="outside lower center")
    return figure


def _words(override: str) -> str:
    """Return an override in words, such as "optimizer learning rate=1e-3"."""
    return re.sub(r"[._=]+(?!\d)", " ", override.lstrip("+")).replace(" lr", " learning rate")
