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

    Returns:
        The peak, and the slope over the last four fifths of the frames.
    """
    frames = 6_000 if quick else frames
    run = folder / "memory"
    command = ["train", "trainer.target_share=null", f"trainer.total_frames={frames}"]
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
    settled = np.array([s for s in samples if s[0] >= frames / 5 and s[1] > 0])
    slope = float(np.polyfit(settled[:, 0], settled[:, 1], 1)[0]) if len(settled) > 2 else None
    return {
        "peak_memory_mib": peak,
        "memory_growth_mib_per_million_frames": None if slope is None else slope * 1e6,
        "memory_frames": frames,
    }


def _frames(path: Path) -> int:
    if not path.exists():
        return 0
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    return int(rows[-1]["frames"]) if rows and rows[-1]["frames"] else 0
