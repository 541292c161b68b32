"""Honest policies that become "not certain" because their episodes end otherwise when repeated."""

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
        "fragile_honest": number of policies that are not certain because repeated episodes end
        otherwise, out of "fragile_honest_total"; "fragile_episodes_most": the most such episodes of
        a policy, out of 50; "blind_honest": policies said not to use their camera, by name.
    """
    folder = setup.runs / "fragile_honest"
    names = ["good", "poor"] if setup.quick else policy_names()
    policies: list[Any] = [load_policy(name) for name in names]
    for seed in setup.seeds:
        run = folder / f"seed_{seed}"
        train(run, f"seed={seed}")
        policies.append(load_policy(run))
    settings = JudgeSettings(sampled=False, episodes=50 if setup.quick else 400)
    verdicts = {policy.name: judge(policy, settings, progress=silent) for policy in policies}
    repeated = [verdict.repetition for verdict in verdicts.values() if verdict.repetition]
    return {
        "fragile_honest": sum(not repetition.is_same for repetition in repeated),
        "fragile_honest_total": len(repeated),
        "fragile_episodes_most": max(repetition.worst.different for repetition in repeated),
        "blind_honest": [
            name for name, of in verdicts.items() if of.camera and of.camera.is_used is False
        ],
    }
