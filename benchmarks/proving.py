"""Proofs of shipped and of freshly trained policies: how long, how much, and do they hold?"""

import multiprocessing
import statistics
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import torch

from benchmarks import commands
from benchmarks.tampering import count_refused
from drone_rl.config.training import TrainerSettings
from drone_rl.policies import PolicyNetwork
from drone_rl.policies.policy import load_policy
from drone_rl.training.train import train
from drone_rl.utils.progress import silent
from drone_rl.verification.check import Check, check
from drone_rl.verification.prove import Proof, prove

ASKED_FOR = 148_000
"""Pictures a second that the default's network did where the figures for proofs were asked."""
_BATCH, _TIMES = 1024, 15


@torch.no_grad()
def network_pictures_per_s(network: PolicyNetwork, shape: tuple[int, ...]) -> float:
    """Pictures a second that a network looks at, with as many threads as torch takes.

    Args:
        network: Any.
        shape: Of one picture, (C, H, W).
    """
    pictures, seconds = torch.rand(_BATCH, *shape), []
    for _ in range(_TIMES):
        begin = time.perf_counter()
        network(pictures)
        seconds.append(time.perf_counter() - begin)
    return _BATCH / statistics.median(seconds)


FLIGHTS = 105_000
"""Of all certificates together, at most: somewhat more than the 100,000 that are asked for."""
SMALL_PARTS = {4: 2e7, 5: 5e7}
"""By number of cubes, combinations of pictures of a part: so few that parts are done in time."""


def bench_prove(folder: Path, seeds: Sequence[int], quick: bool) -> dict[str, Any]:
    """Trains the default from each seed, proves what came of it, and checks every certificate.

    Args:
        folder: For runs and certificates.
        seeds: Of the trainings.
        quick: Whether one cube and one seed will do.

    Returns:
        "proof_two_s" of policy good with two cubes; "proof_three_s", "proof_success",
        "proof_lost" and "proof_undecided" of each seed's policy with the default's three; how many
        certificates the second checker accepts, and how many of its flights end otherwise than
        proved; the pictures a second that the network alone looks at, and the times as they would
        be where those are 148,000, for which the figures were asked.
    """
    two, three = (1, 1) if quick else (2, 3)
    policy = load_policy("good")
    camera = policy.description.camera
    pace = network_pictures_per_s(policy.make_network(), (1, camera.height, camera.width))
    slower = ASKED_FOR / pace
    good, good_s = _timed("good", two, folder / "good")
    proofs, seconds = {"good": good}, []
    for seed in seeds[:1] if quick else seeds:
        run = folder / f"seed_{seed}"
        limits = TrainerSettings(total_frames=10_000) if quick else TrainerSettings()
        train(folder=run, seed=seed, trainer=limits, progress=silent)
        proofs[str(run)], taken = _timed(run, three, run)
        seconds.append(taken)
    trained = list(proofs.values())[1:]
    for name in ("poor", "right_and_forward"):
        proofs[name], _ = _timed(name, two, folder / name)
    flights = 100 if quick else -(-FLIGHTS // len(proofs))
    checks = [_check(proof, policy, flights) for policy, proof in proofs.items()]
    return {
        "proof_two_s": good_s,
        "proof_three_s": seconds,
        "proof_network_pictures_per_s": pace,
        "proof_two_scaled_s": good_s / slower,
        "proof_three_scaled_s": [taken / slower for taken in seconds],
        "proof_success": [proof.success for proof in trained],
        "proof_lost": [proof.lost for proof in trained],
        "proof_undecided": max(proof.undecided for proof in trained),
        "proof_undecided_each": [proof.undecided for proof in trained],
        "proof_contradicted": sum(done.findings.contradicted for done in checks),
        "proof_flights": sum(sum(done.findings.flights.values()) for done in checks),
        "proof_checked": sum(done.accepted for done in checks),
        "proof_checked_total": len(checks),
    }


def bench_many_cubes(folder: Path, hours: float, quick: bool) -> dict[str, Any]:
    """How much is decided of policy good with four and with five cubes in a given time.

    Both at once, each in a process of its own, as a proof works on one core; one after the other if
    quick.

    Args:
        folder: For certificates.
        hours: For each.
        quick: Whether a few seconds will do.

    Returns:
        "proof_four", "proof_five": the shares decided, and the seconds that it took.
    """
    limit, names = 1.0 if quick else 3600 * hours, {4: "proof_four", 5: "proof_five"}
    context = multiprocessing.get_context("spawn")
    with ThreadPoolExecutor(1) if quick else ProcessPoolExecutor(2, context) as processes:
        begun = {
            name: processes.submit(_decided, cubes, folder / name, limit)
            for cubes, name in names.items()
        }
        done = {name: one.result() for name, one in begun.items()}
    shares = {name: share for name, (share, _) in done.items()}
    return shares | {f"{name}_s": seconds for name, (_, seconds) in done.items()}


def _decided(cubes: int, folder: Path, limit_s: float) -> tuple[float, float]:
    begin = time.perf_counter()
    proof = prove(
        "good",
        folder=folder,
        task={"num_cubes": cubes},
        limit_s=limit_s,
        most_combinations=int(SMALL_PARTS[cubes]),
        most_boxes=20_000_000,
        progress=silent,
    )
    return 1.0 - proof.undecided, time.perf_counter() - begin


def bench_tampering(folder: Path, quick: bool) -> dict[str, Any]:
    """Proves two small tasks, and tampers with their certificates in every way there is.

    Args:
        folder: For certificates.
        quick: Whether one of them will do.

    Returns:
        How many of the tampered certificates are refused, and how many there are.
    """
    paths = {}
    for cubes in (1,) if quick else (1, 2):
        name = "right_and_forward"
        _timed(name, cubes, folder / f"{name}_{cubes}")
        paths[folder / f"{name}_{cubes}" / "certificate.json"] = None
    return count_refused(paths)


def _timed(policy: str | Path, num_cubes: int, folder: Path) -> tuple[Proof, float]:
    begin = time.perf_counter()
    task = {"num_cubes": num_cubes}
    proof = prove(load_policy(policy), folder=folder, task=task, progress=silent)
    return proof, time.perf_counter() - begin


def _check(proof: Proof, policy: str, flights: int) -> Check:
    assert proof.folder is not None
    path = proof.folder / "certificate.json"
    return check(path, policy, flights=flights, seed=0, progress=silent)


def bench_provable(folder: Path, seeds: Sequence[int], quick: bool) -> dict[str, Any]:
    """Trains from each seed until the policy is proved, as a user starts it.

    Args:
        folder: For the runs.
        seeds: Of the trainings.
        quick: Whether one cube and one seed will do.

    Returns:
        Per seed: seconds from the start of the command to its end, searches for failures, and
        whether it is proved.
    """
    results: dict[str, list] = {"provable_s": [], "provable_rounds": [], "provable_proved": []}
    easier = ["task=collect_one", "provable.flights=500"] if quick else []
    for seed in seeds[:1] if quick else seeds:
        run = folder / f"provable_{seed}"
        seconds, result = commands.train(run, "experiment=provable", f"seed={seed}", *easier)
        results["provable_s"].append(seconds)
        results["provable_rounds"].append(len(result["rounds"]))
        results["provable_proved"].append(result["reason"] == "proved")
    return results
