"""Correctness of verdicts: certain verdicts after 400 episodes against 5,000 other episodes.

The policies are the shipped ones, the baselines, scripted ones with known flaws, and trained ones
with learning rates from low to far too high. The true kind of each is the kind by the same rule
after 5,000 episodes in environments that the verdict did not use.
"""

import functools
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import torch

from benchmarks.benchmark import Setup
from benchmarks.commands import call
from benchmarks.scripted_policies import SCRIPTS, Script, ScriptedPolicy
from drone_rl.collectors.complete_episodes import CompleteEpisodes, rollout
from drone_rl.config import TaskSettings
from drone_rl.envs import DroneEnv
from drone_rl.trust.baselines import BASELINES, run_baselines
from drone_rl.trust.results import Verdict
from drone_rl.trust.rule import VerdictKind
from drone_rl.trust.verdict import apply_rule
from drone_rl.utils.exit_codes import NOT_CERTAIN
from drone_rl.utils.seeding import Stream

SHIPPED = ("good", "poor", "right_and_forward")
"""Shipped policies."""
RATES = (1e-3, 2e-3, 7e-3, 1e-2)
"""Learning rates of trained policies."""
SEEDS = (1, 2, 3)
EPISODES, OTHERS = 400, 5000
"""Episodes of a verdict, and of the true kind."""
_NUM_ENVS = 500
_STATUSES = (NOT_CERTAIN, *(kind.exit_code for kind in VerdictKind))


def bench_verdicts(setup: Setup) -> dict[str, Any]:
    """Compare verdicts with the true kinds of policies.

    Returns:
        See `count`.
    """
    folder = setup.runs
    scripts = dict(list(SCRIPTS.items())[:3]) if setup.quick else SCRIPTS
    verdicts = {name: _judge_script(script, setup.quick) for name, script in scripts.items()}
    for name, policy in _policies(folder, setup.device, setup.quick):
        verdicts[name] = _judge_policy(
            folder / f"judge_{len(verdicts)}", policy, setup.device, setup.quick
        )
    return count(verdicts)


def count(verdicts: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Count the certain verdicts, and those of them that are right.

    Args:
        verdicts: For each policy "kind" and "certain" of the verdict, and "is", the true kind.
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


def _judge_script(script: Script, quick: bool) -> dict[str, Any]:
    few, many = (_verdict(script, n, seed) for seed, n in enumerate(_sizes(quick)))
    return {"kind": few.kind.value, "certain": few.certain, "is": many.kind.value}


def _verdict(script: Script, episodes: int, seed: int) -> Verdict:
    task = script.settings
    env = _make_env(task, seed)
    policy = ScriptedPolicy(script, torch.Generator().manual_seed(seed))
    hashable: Any = task
    return apply_rule(rollout(policy, env, episodes), _baselines(hashable, episodes, seed))


@functools.cache
def _baselines(task: TaskSettings, episodes: int, seed: int) -> dict[str, CompleteEpisodes]:
    """Return the episodes of a task's baselines; they run once for all scripts."""
    return run_baselines(_NUM_ENVS, task, _make_env(task, seed).state_dict(), episodes)


def _make_env(task: TaskSettings, seed: int) -> DroneEnv:
    return DroneEnv(_NUM_ENVS, task, pixels=False, seed=seed, stream=Stream.REPORT)


def _policies(folder: Path, device: str, quick: bool) -> Iterator[tuple[str, str]]:
    """Yield names and values of `policy=` of `drone-rl verdict`; train policies on demand."""
    for name in (*SHIPPED[:1], "random") if quick else (*SHIPPED, *BASELINES):
        yield name, name
    for rate in () if quick else RATES:
        for seed in SEEDS:
            run = folder / f"verdict_{rate:g}_{seed}"
            settings = ["experiment=high_rate", f"optimizer.lr={rate:g}", f"seed={seed}"]
            call("train", *settings, "logger=csv", f"device={device}", f"hydra.run.dir={run}")
            yield f"lr={rate:g} seed={seed}", str(run / "checkpoints" / "last.pt")


def _judge_policy(folder: Path, policy: str, device: str, quick: bool) -> dict[str, Any]:
    verdicts = []
    for seed, episodes in enumerate(_sizes(quick)):
        run = folder / str(episodes)
        settings = [f"episodes={episodes}", f"seed={seed}", f"device={device}", "sampled=false"]
        settings.append(f"num_envs={min(episodes, _NUM_ENVS)}")
        call("verdict", f"policy={policy}", *settings, f"hydra.run.dir={run}", statuses=_STATUSES)
        verdicts.append(json.loads((run / "verdict.json").read_text()))
    few, many = verdicts
    return {"kind": few["kind"], "certain": few["certain"], "is": many["kind"]}
