"""Trainings with an image, and without it for as many frames: whether the image is needed."""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.benchmark import Setup
from benchmarks.commands import call
from drone_rl.trust.rule import VerdictKind
from drone_rl.utils.exit_codes import NOT_CERTAIN
from drone_rl.utils.files import read_json
from drone_rl.utils.run_result import RunResult

STATUSES = (NOT_CERTAIN, *(kind.exit_code for kind in VerdictKind))
"""Exit statuses of verdicts."""


class Trainings(NamedTuple):
    """Results of trainings, one of each seed."""

    seconds: list[float]
    """Until the training with the image ends."""
    frames: list[int]
    """Of each of both."""
    seeing: list[dict[str, Any]]
    """Success rates of the verdicts on policies with the image, with intervals."""
    blind: list[dict[str, Any]]


def train_both(
    setup: Setup,
    folder: Path,
    most: int,
    seeing: Sequence[str],
    blind: Sequence[str],
    plugins: Sequence[str] = (),
    where: Path | None = None,
) -> Trainings:
    """Train and judge policies of three seeds with an image and without.

    Args:
        setup: Of the benchmark.
        folder: For the runs.
        most: Frames after which a training ends at the latest.
        seeing: Settings of the task and the training with the image.
        blind: Those without it.
        plugins: Settings of all commands.
        where: Working folder of the commands.
    """
    most = 20_000 if setup.quick else most
    made = Trainings([], [], [], [])
    for seed in setup.seeds[:3]:
        run = folder / f"seeing_{seed}"
        begin = time.perf_counter()
        train(run, seed, most, *plugins, *seeing, where=where)
        made.seconds.append(time.perf_counter() - begin)
        made.frames.append(RunResult.read_json(run / "result.json").frames)
        made.seeing.append(_success(run, setup.quick, plugins, where))
        run = folder / f"blind_{seed}"
        endless = "trainer.target_share=null"
        train(run, seed, made.frames[-1], *plugins, *blind, endless, where=where)
        made.blind.append(_success(run, setup.quick, plugins, where))
    return made


def train(run: Path, seed: int, most: int, *settings: str, where: Path | None = None) -> None:
    """Train for at most so many frames, in a working folder."""
    last = ("logger=csv", f"seed={seed}", f"trainer.total_frames={most}", f"hydra.run.dir={run}")
    call("train", *settings, *last, folder=where)


def _success(run: Path, quick: bool, plugins: Sequence[str], where: Path | None) -> dict[str, Any]:
    made, few = run / "verdict", ["episodes=100"] if quick else []
    given = (f"policy={run}", f"hydra.run.dir={made}", *plugins, *few)
    call("verdict", *given, statuses=STATUSES, folder=where)
    return read_json(made / "verdict.json")["greedy"]["success"]
