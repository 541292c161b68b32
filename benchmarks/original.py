"""The chapter's own algorithm: which learning rate and schedule reach the chapter's criterion."""

import csv
import itertools
import json
import shutil
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from benchmarks.benchmark import Setup
from benchmarks.commands import call, train
from benchmarks.ledger import digest_code
from drone_rl.utils.files import read_json, write_atomically
from drone_rl.utils.palette import BAD, FAINT, GOOD, INK, ONE_SIDED, css

Curve = Sequence[tuple[int, float]]
"""Episodes, and the running mean of the reward after them."""

SCHEDULES = ("step_decay", "constant")
"""Of the learning rate: the original study's, and none, as Algorithm 4 is printed."""
RATES = (3e-5, 1e-4, 1e-3)
"""Learning rates at the start; the original study has the middle one."""
SEEDS = range(5)
DEFAULT = "default"
"""The training that `drone-rl train` does, for comparison."""
EPISODES = 30_000
"""Episodes after which the original study stops."""
FROZEN = 5_000
"""Episodes after which some trainings stop, because nothing is learned any more.

The original study's schedule has then decayed to 4e-5 of its first rate, and a running mean that
still passes the criterion does so by chance. At the largest rate, policies soon touch no cube in
any episode; an episode without a reward has the gradient zero, and the policy stays as it is.
"""
TARGET = 2.99
TRAINED = ("sim", "envs", "policies", "collectors", "objectives", "training", "conf")
"""Code whose change makes earlier runs void; see `Benchmark.measures`."""
_COLORS = {"good": GOOD, "one-sided": ONE_SIDED, "poor": BAD, "none of these": INK}
"""Colors of lines by the first words of the verdict on the trained policy."""


def bench_original(setup: Setup) -> dict[str, Any]:
    """Train `experiment=original` at three rates with two schedules, and the default, and plot it.

    A seed that an earlier, interrupted call of the same code has trained is not trained again.

    Returns:
        "original_runs": for each training, such as "constant 0.0001", and each seed, whether it
        reached the criterion, its episodes, frames, seconds, and kind of verdict;
        "original_best": the training with most solved seeds, `experiment=default` excepted;
        "original_solved": its number of solved seeds; "original_seeds": seeds of each training.

    Raises:
        RuntimeError: A command failed.
    """
    folder = setup.folder / "original" / digest_code(TRAINED)  # kept between calls
    seeds = SEEDS[:1] if setup.quick else SEEDS
    runs = {}
    for name, settings in trainings(setup.quick).items():
        runs[name] = train_seeds(folder / name, settings, seeds)
    curves = {
        name: [
            (run, read_curve(folder / name / str(seed)))
            for seed, run in zip(seeds, runs[name], strict=True)
        ]
        for name in runs
    }
    plot(curves, setup.folder / "original.png")
    solved = {name: sum(run["solved"] for run in runs[name]) for name in runs if name != DEFAULT}
    best = max(solved, key=lambda name: solved[name])
    return {
        "original_runs": runs,
        "original_best": best,
        "original_solved": solved[best],
        "original_seeds": len(seeds),
    }


def trainings(quick: bool) -> dict[str, list[str]]:
    """Return the settings of each training by its name."""
    settings: dict[str, list[str]] = {}
    for schedule, rate in itertools.product(SCHEDULES, RATES):
        frozen = schedule == "step_decay" or rate == max(RATES)
        most = 20 if quick else FROZEN if frozen else EPISODES
        overrides = [
            f"scheduler={schedule}",
            f"optimizer.lr={rate:g}",
            f"trainer.total_episodes={most}",
        ]
        settings[f"{schedule} {rate:g}"] = ["experiment=original", *overrides]
    settings[DEFAULT] = ["trainer.total_episodes=100"] if quick else []
    return settings


def train_seeds(folder: Path, settings: Sequence[str], seeds: Sequence[int]) -> list[Any]:
    """Train from each seed, two at a time, and judge the policies."""

    def one(seed: int) -> dict[str, Any]:
        run = folder / str(seed)
        if (run / "outcome.json").exists():
            return read_json(run / "outcome.json")
        shutil.rmtree(run, ignore_errors=True)
        seconds, result = train(run, *settings, f"seed={seed}")
        place = f"hydra.run.dir={run}/verdict"
        call("verdict", f"policy={run}", "seed=0", place, statuses=tuple(range(20)))
        verdict = read_json(run / "verdict" / "verdict.json")
        outcome = {
            "solved": result.reason == "solved",
            "episodes": result.episodes,
            "frames": result.frames,
            "seconds": seconds,
            "verdict": f"{verdict['kind']}{'' if verdict['certain'] else ' (not certain)'}",
        }
        write_atomically(run / "outcome.json", json.dumps(outcome))
        return outcome

    with ThreadPoolExecutor(2) as pool:
        return list(pool.map(one, seeds))


def read_curve(run: Path) -> Curve:
    """Return episodes and the running reward of a run, at most 200 points, the last included."""
    with (run / "metrics.csv").open(newline="") as file:
        rows = [
            (int(r["episodes"]), float(r["train/running_reward"])) for r in csv.DictReader(file)
        ]
    indices = {round(len(rows) ** (i / 200)) - 1 for i in range(201)}
    return [rows[i] for i in sorted(indices)]


def plot(curves: Mapping[str, Sequence[tuple[Mapping[str, Any], Curve]]], path: Path) -> None:
    """Plot the running reward over episodes: a panel for each training, a line for each seed.

    Args:
        curves: By training, the outcome and the learning curve for each seed.
        path: Path of the image.
    """
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    figure = Figure(figsize=(11, 5.5), layout="constrained")
    panels = figure.subplots(len(SCHEDULES), len(RATES) + 1, sharex=True, sharey=True)
    names = [[f"{schedule} {rate:g}" for rate in RATES] for schedule in SCHEDULES]
    for axes, name in zip(panels.flat, [*names[0], DEFAULT, *names[1], ""], strict=True):
        if name not in curves:
            axes.set_axis_off()
            continue
        of_seeds = curves[name]
        solved = sum(run["solved"] for run, _ in of_seeds)
        count = f"reached {TARGET}: {solved} of {len(of_seeds)} seeds"
        if name == DEFAULT:
            count = "drone-rl train; stops at 2.97"
        axes.set_title(f"{name.replace('_', ' ')}\n{count}", fontsize=9, loc="left")
        axes.axhline(TARGET, color=css(FAINT), linewidth=0.8)
        for run, curve in of_seeds:
            kind = next(kind for kind in _COLORS if run["verdict"].startswith(kind))
            episodes, rewards = zip(*curve, strict=True)
            axes.plot(episodes, rewards, color=css(_COLORS[kind]), linewidth=1.2)
            axes.plot(episodes[-1], rewards[-1], "o", color=css(_COLORS[kind]), markersize=4)
        axes.set(xscale="log", xlim=(10, 1.3 * EPISODES), ylim=(0, 3.1))
        axes.spines[["top", "right"]].set_visible(False)
    figure.supxlabel("episodes", fontsize=9)
    figure.supylabel("cubes per episode (running mean)", fontsize=9)
    lines = [Line2D([], [], color=css(color)) for color in _COLORS.values()]
    title = "verdict on the trained policy"
    panels[-1, -1].legend(lines, [*_COLORS], loc="center", frameon=False, title=title)
    figure.savefig(path, dpi=110)
