"""Whole trainings, as a user starts them: time to solve, success, memory."""

import csv
import json
import subprocess
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from drone_rl.bench.commands import PROGRAM, call, memory_status

SETTLING_FRAMES = 100_000
"""After which a training has seen what it will see: numbers of worlds, lengths of batches."""


def bench_solve(
    folder: Path, seeds: Sequence[int], episodes: int, device: str, quick: bool
) -> dict[str, Any]:
    """Trains with the defaults from each seed and evaluates each policy, greedy.

    Returns:
        Per seed: seconds from the start of the command to its end, whether it reached the target
        and the lower end of the exact 95% interval of the share of complete episodes.
    """
    results: dict[str, list] = {"time_to_solve_s": [], "frames_to_solve": [], "success_lower95": []}
    reasons = []
    settings = ["experiment=smoke"] if quick else []
    for seed in seeds[:1] if quick else seeds:
        run = folder / f"train_{seed}"
        begin = time.perf_counter()
        call("train", f"seed={seed}", f"device={device}", f"hydra.run.dir={run}", *settings)
        results["time_to_solve_s"].append(time.perf_counter() - begin)
        result = json.loads((run / "result.json").read_text())
        results["frames_to_solve"].append(result["frames"])
        reasons.append(result["reason"])
        call(
            "evaluate",
            f"checkpoint={run}",
            f"episodes={50 if quick else episodes}",
            "baselines=false",
            "videos=0",
            f"device={device}",
            f"hydra.run.dir={run}/evaluation",
        )
        evaluation = json.loads((run / "evaluation" / "evaluation.json").read_text())
        results["success_lower95"].append(evaluation["greedy"]["success"]["lower95"])
    return {
        **results,
        "median_time_to_solve_s": float(np.median(results["time_to_solve_s"])),
        "seeds_solved": reasons.count("solved"),
        "seeds_tried": len(reasons),
    }


def bench_memory(folder: Path, frames: int, device: str, quick: bool) -> dict[str, Any]:
    """Trains on past the target and watches the resident memory.

    Args:
        folder: For the run.
        frames: Over which memory must stay flat, after the first `SETTLING_FRAMES`.
        device: Where to train.
        quick: Whether a few thousand will do.

    Returns:
        The peak, and the growth.
    """
    settling, frames = (1_000, 5_000) if quick else (SETTLING_FRAMES, frames)
    run = folder / "memory"
    command = ["train", "trainer.target_share=null", f"trainer.total_frames={settling + frames}"]
    process = subprocess.Popen(
        [*PROGRAM, *command, f"device={device}", f"hydra.run.dir={run}", "logger=csv"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    samples, peak = [], 0.0
    while process.poll() is None:
        status = memory_status(process.pid)
        peak = max(peak, status.get("VmHWM", 0.0))
        samples.append((_frames(run / "metrics.csv"), status.get("VmRSS", 0.0)))
        time.sleep(0.5)
    if process.returncode != 0:
        raise RuntimeError(f"the training for the memory benchmark failed: {process.returncode}")
    return {
        "peak_memory_mib": peak,
        "memory_growth_mib_per_million_frames": growth(samples, settling),
        "memory_frames": frames,
    }


_SPANS = 10


def growth(samples: Sequence[tuple[int, float]], settling: int) -> float | None:
    """Slope of the line through the lowest samples of some spans, once memory has settled.

    Within a batch memory swings by a hundred MiB, and by chance more in one span than in another;
    what is never given back shows in the lowest.

    Args:
        samples: Frames and resident memory, MiB; 0 where that could not be read.
        settling: Frames before which a sample does not count.

    Returns:
        MiB for a million frames; None where there are too few samples.
    """
    settled = np.array([s for s in samples if s[0] >= settling and s[1] > 0])
    if len(settled) < 3 or settled[0, 0] == settled[-1, 0]:
        return None
    edges = np.linspace(settled[0, 0], settled[-1, 0], _SPANS + 1)[1:-1]
    span = np.searchsorted(edges, settled[:, 0], side="right")
    spans = (settled[span == i] for i in np.unique(span))
    lowest = np.array([each[each[:, 1].argmin()] for each in spans])
    return float(np.polyfit(lowest[:, 0], lowest[:, 1], 1)[0]) * 1e6


def _frames(path: Path) -> int:
    """Frames of the last whole row of a training's metrics."""
    if not path.exists():
        return 0
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    return int(rows[-1]["frames"]) if rows and rows[-1]["frames"] else 0
