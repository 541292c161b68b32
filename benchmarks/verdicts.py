"""Whether verdicts are right: those that are certain after 400 episodes against 5,000 others.

The policies are those that travel with the package, the baselines, those made by hand, whose flaws
are known, and trained ones, at rates from low to far too high. What each is "in truth" is the same
rule's word on episodes in worlds that the verdict never saw.
"""

import functools
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import torch

from benchmarks.commands import call
from benchmarks.scripted_policies import PILOTS, Pilot, ScriptedPolicy
from drone_rl.config import TaskSettings
from drone_rl.envs import DroneEnv
from drone_rl.evaluation.baselines import BASELINES, run_baselines
from drone_rl.evaluation.judge import judge
from drone_rl.evaluation.metrics import Episodes
from drone_rl.evaluation.rollouts import run_episodes
from drone_rl.evaluation.rule import NOT_CERTAIN, Kind
from drone_rl.utils.seeding import Stream

SHIPPED = ("good", "poor", "right_and_forward")
"""Policies that travel with the package."""
RATES = (1e-3, 2e-3, 7e-3, 1e-2)
SEEDS = (1, 2, 3)
EPISODES, OTHERS = 400, 5000
"""Of a verdict, and of what it is compared with."""
_NUM_WORLDS = 500
_STATUSES = (NOT_CERTAIN, *(kind.exit_code for kind in Kind))


def bench_verdicts(folder: Path, device: str, quick: bool) -> dict[str, Any]:
    """Compares verdicts with what the policies are.

    Args:
        folder: Where trainings and verdicts are kept.
        device: Where policies fly.
        quick: Whether to judge a few policies only, by few episodes.
    """
    pilots = dict(list(PILOTS.items())[:3]) if quick else PILOTS
    verdicts = {name: _judge_pilot(pilot, quick) for name, pilot in pilots.items()}
    for name, policy in _policies(folder, device, quick):
        verdicts[name] = _judge_policy(folder / f"judge_{len(verdicts)}", policy, device, quick)
    return count(verdicts)


def count(verdicts: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """How many verdicts are certain, and how many of these are right.

    Args:
        verdicts: Of each policy "kind" and "certain" by the verdict, and what it "is".
    """
    certain = [entry for entry in verdicts.values() if entry["certain"]]
    return {
        "verdicts_right": sum(entry["kind"] == entry["is"] for entry in certain),
        "verdicts_certain": len(certain),
        "verdicts_total": len(verdicts),
        "verdicts": verdicts,
    }


def _sizes(quick: bool) -> tuple[int, int]:
    return (100, 200) if quick else (EPISODES, OTHERS)


def _judge_pilot(pilot: Pilot, quick: bool) -> dict[str, Any]:
    few, many = (_verdict(pilot, n, seed) for seed, n in enumerate(_sizes(quick)))
    return {"kind": few["kind"], "certain": few["certain"], "is": many["kind"]}


def _verdict(pilot: Pilot, episodes: int, seed: int) -> dict[str, Any]:
    task = pilot.settings
    env = _worlds(task, seed)
    flown = run_episodes(env, ScriptedPolicy(pilot, torch.Generator().manual_seed(seed)), episodes)
    return judge(flown, _baselines(task, episodes, seed)).as_dict()


@functools.cache
def _baselines(task: TaskSettings, episodes: int, seed: int) -> dict[str, Episodes]:
    """Those of a task, flown once for all pilots."""
    return run_baselines(_NUM_WORLDS, task, _worlds(task, seed).state_dict(), episodes)


def _worlds(task: TaskSettings, seed: int) -> DroneEnv:
    return DroneEnv(_NUM_WORLDS, task, pixels=False, seed=seed, stream=Stream.REPORT)


def _policies(folder: Path, device: str, quick: bool) -> Iterator[tuple[str, str]]:
    """Names and what `drone-rl verdict` takes; trains as it goes."""
    for name in (*SHIPPED[:1], "random") if quick else (*SHIPPED, *BASELINES):
        yield name, name
    for rate in () if quick else RATES:
        for seed in SEEDS:
            run = folder / f"verdict_{rate:g}_{seed}"
            settings = ["experiment=high_rate", f"optimiser.lr={rate:g}", f"seed={seed}"]
            call("train", *settings, "logger=csv", f"device={device}", f"hydra.run.dir={run}")
            yield f"lr={rate:g} seed={seed}", str(run / "checkpoints" / "last.pt")


def _judge_policy(folder: Path, policy: str, device: str, quick: bool) -> dict[str, Any]:
    verdicts = []
    for seed, episodes in enumerate(_sizes(quick)):
        run = folder / str(episodes)
        settings = [f"episodes={episodes}", f"seed={seed}", f"device={device}", "sampled=false"]
        settings.append(f"num_envs={min(episodes, _NUM_WORLDS)}")
        call("verdict", f"policy={policy}", *settings, f"hydra.run.dir={run}", statuses=_STATUSES)
        verdicts.append(json.loads((run / "verdict.json").read_text()))
    few, many = verdicts
    return {"kind": few["kind"], "certain": few["certain"], "is": many["kind"]}
