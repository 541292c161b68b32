"""Honest policies that become "not certain" because their decisions depend on rounding."""

from typing import Any

from benchmarks.benchmark import Setup
from benchmarks.commands import train
from drone_rl.config.commands import JudgeSettings
from drone_rl.policies.policy import load_policy
from drone_rl.policies.zoo import policy_names
from drone_rl.trust.judge import judge
from drone_rl.utils.progress import silent


def bench_fragile_honest(setup: Setup) -> dict[str, Any]:
    """Judge the shipped policies and default trainings.

    Returns:
        "fragile_honest": number of policies that are not certain because of rounding, out of
        "fragile_honest_total"; "fragile_frames_most" and "fragile_episodes_most": the largest
        rates of fragile frames, and of episodes with fragile frames.
    """
    folder = setup.runs / "fragile_honest"
    names = ["good", "poor"] if setup.quick else policy_names()
    policies: list[Any] = [load_policy(name) for name in names]
    for seed in setup.seeds:
        run = folder / f"seed_{seed}"
        train(run, f"seed={seed}")
        policies.append(load_policy(run))
    settings = JudgeSettings(sampled=False, episodes=50 if setup.quick else 400)
    checks = (judge(policy, settings, progress=silent).rounding for policy in policies)
    roundings = [check for check in checks if check is not None]
    return {
        "fragile_honest": sum(rounding.decides for rounding in roundings),
        "fragile_honest_total": len(roundings),
        "fragile_frames_most": max(rounding.fragile_rate for rounding in roundings),
        "fragile_episodes_most": max(
            rounding.fragile_episodes / rounding.episodes for rounding in roundings
        ),
    }
