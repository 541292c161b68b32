"""One training of a peer in a process of its own, so that its start counts.

    python -m benchmarks.peers.program sb3_ppo --seed 100 --started "$(date +%s.%N)"

It prints a line of JSON: "seconds" from the start of the process until it is solved,
"seconds_without_imports", "frames", "is_solved", and of as many held-out greedy episodes as were
asked for "success_lower95".
"""

import argparse
import json
import sys
import time
from collections.abc import Callable, Sequence
from typing import Any

from drone_rl.utils.errors import extra


def _sb3(algorithm: str) -> Callable[..., Any]:
    extra("stable_baselines3", "sb3", "drone-rl bench peers")
    from benchmarks.peers.sb3 import train_sb3

    return lambda seed, **settings: train_sb3(algorithm, seed, **settings)


def _torchrl() -> Callable[..., Any]:
    from benchmarks.peers.torchrl import train_torchrl

    return train_torchrl


PEERS: dict[str, Callable[[], Callable[..., Any]]] = {
    "sb3_ppo": lambda: _sb3("ppo"),
    "sb3_a2c": lambda: _sb3("a2c"),
    "torchrl": _torchrl,
}
"""By name, what imports how it is trained."""


def measure(arguments: Sequence[str]) -> dict[str, Any]:
    """Trains, and looks at the clock.

    Args:
        arguments: Of the program.

    Returns:
        What it prints.

    Raises:
        InputError: Something isn't installed, or a setting can't be.
    """
    began = time.time()
    given = _parser().parse_args(arguments)
    settings, train = json.loads(given.settings), PEERS[given.peer]()
    imported = time.time()
    done = train(given.seed, max_frames=given.max_frames, **settings)
    solved = time.time()
    found = {
        "seconds": solved - (began if given.started is None else given.started),
        "seconds_without_imports": solved - imported,
        "frames": done.frames,
        "is_solved": done.is_solved,
    }
    if given.episodes:
        found["success_lower95"] = success_lower95(done.policy, given.episodes)
    return found


def success_lower95(policy: Any, episodes: int) -> float:
    """Lower end of the exact 95% interval of the share of held-out episodes with all cubes.

    Args:
        policy: What `drone_rl.evaluate` takes.
        episodes: To fly, greedily.
    """
    from drone_rl.evaluation.evaluate import evaluate
    from drone_rl.utils.progress import silent

    flown = evaluate(policy, episodes=episodes, seed=0, baselines=False, progress=silent).flown
    return flown["greedy"]["success"]["lower95"]


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.peers.program")
    parser.add_argument("peer", choices=PEERS)
    parser.add_argument("--seed", type=int, default=0, help="of worlds, weights and actions")
    parser.add_argument("--started", type=float, help="when the process began, as time.time()")
    parser.add_argument("--episodes", type=int, default=0, help="held-out ones to fly afterwards")
    parser.add_argument("--max-frames", type=int, default=1_000_000, help="to stop after")
    parser.add_argument("--settings", default="{}", help="of the peer's function: JSON")
    return parser


if __name__ == "__main__":
    sys.stdout.write(json.dumps(measure(sys.argv[1:])) + "\n")
