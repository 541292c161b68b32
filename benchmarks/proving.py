"""Proofs of shipped and newly trained policies: time, decided fraction, and correctness."""

import time
from pathlib import Path
from typing import Any

from benchmarks import commands
from benchmarks.benchmark import Setup
from drone_rl.config.training import TrainerSettings
from drone_rl.policies.policy import load_policy
from drone_rl.training.train import train
from drone_rl.utils.progress import silent
from drone_rl.verification.check import Check, check
from drone_rl.verification.prove import Proof, prove

EPISODES = 105_000
"""Episodes that check all certificates together; the requirement is 100,000."""


def bench_prove(setup: Setup) -> dict[str, Any]:
    """Train the default from each seed, prove the policies, and check every certificate.

    Returns:
        "proof_two_s" of the policy "good" with two cubes; "proof_three_s", "proof_success",
        "proof_lost" and "proof_undecided" of each seed's policy with three cubes; the number of
        certificates that the checker accepts, and of its episodes that contradict them.
    """
    folder = setup.runs / "prove"
    two, three = (1, 1) if setup.quick else (2, 3)
    good, good_s = _timed("good", two, folder / "good")
    proofs, seconds = {"good": good}, []
    for seed in setup.seeds:
        run = folder / f"seed_{seed}"
        limits = TrainerSettings(total_frames=10_000) if setup.quick else TrainerSettings()
        train(folder=run, seed=seed, trainer=limits, progress=silent)
        proofs[str(run)], taken = _timed(run, three, run)
        seconds.append(taken)
    trained = list(proofs.values())[1:]
    for name in ("poor", "right_and_forward"):
        proofs[name], _ = _timed(name, two, folder / name)
    episodes = 100 if setup.quick else -(-EPISODES // len(proofs))
    checks = [_check(proof, policy, episodes) for policy, proof in proofs.items()]
    return {
        "proof_two_s": good_s,
        "proof_three_s": seconds,
        "proof_success": [proof.success for proof in trained],
        "proof_lost": [proof.lost for proof in trained],
        "proof_undecided": max(proof.undecided for proof in trained),
        "proof_undecided_each": [proof.undecided for proof in trained],
        "proof_contradicted": sum(check.contradicted for check in checks),
        "proof_flights": sum(sum(check.flights.values()) for check in checks),
        "proof_checked": sum(check.accepted for check in checks),
        "proof_checked_total": len(checks),
    }


def _timed(policy: str | Path, num_cubes: int, folder: Path) -> tuple[Proof, float]:
    begin = time.perf_counter()
    task = {"num_cubes": num_cubes}
    proof = prove(load_policy(policy), folder=folder, task=task, progress=silent)
    return proof, time.perf_counter() - begin


def _check(proof: Proof, policy: str, episodes: int) -> Check:
    assert proof.folder is not None
    path = proof.folder / "certificate.json"
    return check(path, policy, flights=episodes, seed=0, progress=silent)


def bench_provable(setup: Setup) -> dict[str, Any]:
    """Train `experiment=provable` from each seed until the policy is proved.

    Returns:
        For each seed the seconds until the command ends, the number of rounds (searches for
        failures), and whether the policy is proved.
    """
    folder = setup.runs / "provable"
    results: dict[str, list] = {"provable_s": [], "provable_rounds": [], "provable_proved": []}
    easier = ["task=collect_one", "provable.flights=500"] if setup.quick else []
    for seed in setup.seeds[:3]:
        run = folder / f"provable_{seed}"
        seconds, result = commands.train(run, "experiment=provable", f"seed={seed}", *easier)
        results["provable_s"].append(seconds)
        results["provable_rounds"].append(len(result.rounds))
        results["provable_proved"].append(result.reason == "proved")
    return results
