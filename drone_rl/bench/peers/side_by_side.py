"""Our learners and what a user would pick instead, one after the other on the same machine."""

import json
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

from drone_rl.bench.commands import call
from drone_rl.bench.peers.plot import plot
from drone_rl.bench.peers.program import PEERS, success_lower95

OURS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "reinforce": (),
        "a2c": ("objective=a2c",),
        "ppo": ("objective=ppo",),
    }
)
"""Arguments of `drone-rl train`."""
Measured = dict[str, Any]


def bench_peers(folder: Path, seeds: Sequence[int], episodes: int, quick: bool) -> dict[str, Any]:
    """Trains with each from each seed until it is solved, and judges by held-out episodes.

    Ours is the whole command, its end and its files included; of a peer, what comes after it is
    solved does not count. All of a seed come one after the other, so that a machine that becomes
    slower does so for all.

    Args:
        folder: For the runs, and above it for the picture.
        seeds: Of worlds, weights and actions.
        episodes: Held-out ones.
        quick: Whether a few frames will do.

    Returns:
        "peers": by name, lists by seed of "seconds" from the start of the process,
        "seconds_without_imports", "frames", "is_solved", "success_lower95".
    """
    contenders: dict[str, Callable[..., Measured]] = {}
    for name, arguments in OURS.items():
        contenders[name] = lambda seed, a=arguments, n=name: _ours(
            a, seed, episodes, folder / f"{n}_{seed}", quick
        )
    for name in PEERS:
        contenders[name] = lambda seed, n=name: _peer(n, seed, episodes, quick)
    found: dict[str, dict[str, list]] = {name: {} for name in contenders}
    for seed in seeds[:1] if quick else seeds:
        for name, measure in contenders.items():
            for key, value in measure(seed).items():
                found[name].setdefault(key, []).append(value)
    plot(found, folder.parent.parent / "peers.png")
    return {"peers": found}


def _ours(
    arguments: Sequence[str], seed: int, episodes: int, folder: Path, quick: bool
) -> Measured:
    short = ["trainer.total_frames=1"] if quick else []
    begin = time.perf_counter()
    call("train", *arguments, *short, f"seed={seed}", f"hydra.run.dir={folder}")
    seconds = time.perf_counter() - begin
    result = json.loads((folder / "result.json").read_text())
    return {
        "seconds": seconds,
        "seconds_without_imports": result["seconds"],
        "frames": result["frames"],
        "is_solved": result["reason"] == "solved",
        "success_lower95": success_lower95(folder, episodes),
    }


def _peer(name: str, seed: int, episodes: int, quick: bool) -> Measured:
    options = ["--seed", str(seed), "--episodes", str(episodes)]
    options += ["--max-frames", "1"] if quick else []
    program = [sys.executable, "-m", "drone_rl.bench.peers.program", name]
    command = [*program, *options, "--started", str(time.time())]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{name} failed: {done.stderr.strip()[-500:]}")
    measured = json.loads(done.stdout.splitlines()[-1])
    del measured["running_reward"]
    return measured
