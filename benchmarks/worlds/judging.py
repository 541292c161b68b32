"""Seconds of judging and explaining a policy of the indoor scene, and what its tests trust."""

import time
from pathlib import Path
from typing import Any

import torch

from benchmarks.benchmark import Setup
from benchmarks.commands import call
from benchmarks.maps import count_maps
from benchmarks.worlds.training import STATUSES, WALKING, train
from drone_rl.envs import worlds_of
from drone_rl.explanations.rollouts import collect, select_frames
from drone_rl.explanations.scenes import Scenes
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
    train(run, 0, frames, *WALKING)
    train(plain, 0, frames // 4, *_GRAY, "trainer.target_share=null")
    return {
        "world_verdict_s": _seconds("verdict", run, folder),
        "world_explain_s": _seconds("explain", run, folder),
        "world_shifts_s": _seconds("shifts", run, folder, "axes=[light]"),
        **_maps(plain, setup.quick),
    }


def _seconds(name: str, run: Path, folder: Path, *args: str) -> float:
    begin = time.perf_counter()
    call(name, f"policy={run}", f"hydra.run.dir={folder / name}", *args, statuses=STATUSES)
    return time.perf_counter() - begin


def _maps(run: Path, quick: bool) -> dict[str, Any]:
    """Count trusted adversarial maps and true maps that are found, in frames of the policy."""
    with load_policy(run).flying(64, seed=0) as (env, actor):
        flights = collect(env, actor, num_episodes=14 if quick else 40)
        rows = select_frames(flights.episode, 56 if quick else 240)
        state = flights.state(worlds_of(env))[torch.from_numpy(rows)]
        episode, actions = flights.episode[rows], flights.tensor("actions")[rows]
        found = count_maps(Scenes(env), state, episode, actions, quick)
    return {
        "world_placebos_trusted": found["placebo_maps_trusted"],
        "world_placebos_total": found["placebo_maps_total"],
        "world_planted_found": found["planted_maps_found"],
        "world_planted_total": found["planted_maps_total"],
    }
