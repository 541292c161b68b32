"""Seconds of judging and explaining a policy of the indoor scene, and what its tests trust."""

import time
from pathlib import Path
from typing import Any

from benchmarks.benchmark import Setup
from benchmarks.commands import call
from benchmarks.maps import count_maps_in_flights
from benchmarks.seeing import STATUSES, train
from benchmarks.worlds.training import SCENE, WALKING, task_in
from drone_rl.policies.policy import load_policy

_GRAY = "experiment=reach", "inputs=[gray]"
"""Maps of policies whose map is known are tested on one image."""


def bench_world_judging(setup: Setup) -> dict[str, Any]:
    """Time commands on a policy of the indoor scene, and count maps that the tests trust.

    Returns:
        "world_verdict_s", "world_explain_s", and "world_shifts_s" of one axis, with the default
        numbers of episodes; "world_placebos_trusted" of "world_placebos_total" adversarial maps;
        "world_planted_found", the fraction of "world_planted_total" true maps that are trusted.
    """
    folder, frames = setup.runs / "worlds" / "judging", 20_000 if setup.quick else 600_000
    run, plain = folder / "train", folder / "gray"
    train(run, 0, frames, *task_in(SCENE), *WALKING)
    train(plain, 0, frames // 4, *task_in(SCENE), *_GRAY, "trainer.target_share=null")
    return {
        "world_verdict_s": _seconds("verdict", run, folder),
        "world_explain_s": _seconds("explain", run, folder),
        "world_shifts_s": _seconds("shifts", run, folder, "axes=[light]"),
        **count_maps_in_flights(load_policy(plain), "world", setup.quick),
    }


def _seconds(name: str, run: Path, folder: Path, *args: str) -> float:
    begin = time.perf_counter()
    call(name, f"policy={run}", f"hydra.run.dir={folder / name}", *args, statuses=STATUSES)
    return time.perf_counter() - begin
