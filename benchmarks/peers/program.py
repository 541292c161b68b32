"""Run one third-party training in a separate process, so that start-up time counts.

    python -m benchmarks.peers.program sb3_ppo --seed 100 --started "$(date +%s.%N)"

It prints one line of JSON: "seconds" from the start of the process until solved,
"seconds_without_imports", "frames", "is_solved", the learning "curve", and, with `--episodes`,
"success_lower95" in held-out greedy episodes.
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
"""By name, functions that import a library and return its training function."""


def measure(arguments: Sequence[str]) -> dict[str, Any]:
    """Train and measure the time.

    Args:
        arguments: Arguments of the program.

    Returns:
        The printed values.

    Raises:
        InputError: A library is not installed, or a setting is invalid.
    """
    began = time.time()
    options = _parser().parse_args(arguments)
    settings, train = json.loads(options.settings), PEERS[options.peer]()
    imported = time.time()
    done = train(options.seed, max_frames=options.max_frames, **settings)
    solved = time.time()
    started = began if options.started is None else options.started
    found = {
        "seconds": solved - started,
        "seconds_without_imports": solved - imported,
        "frames": done.frames,
        "is_solved": done.is_solved,
        "curve": [(at - started, reward) for at, reward in done.history],
    }
    if options.episodes:
        found["success_lower95"] = success_lower95(done.policy, options.episodes)
    return found


def success_lower95(policy: Any, episodes: int) -> float:
    """Return the lower bound of the exact 95% interval of the held-out success rate.

    Args:
        policy: Policy, as for `drone_rl.evaluate`.
        episodes: Number of greedy episodes.
    """
    from drone_rl.trust.evaluate import evaluate
    from drone_rl.utils.progress import silent

    result = evaluate(policy, episodes=episodes, seed=0, baselines=False, progress=silent)
    return result.greedy.success.lower95


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.peers.program")
    parser.add_argument("peer", choices=PEERS)
    parser.add_argument(
        "--seed", type=int, default=0, help="seed of environments, weights, actions"
    )
    parser.add_argument("--started", type=float, help="time.time() at process start")
    parser.add_argument("--episodes", type=int, default=0, help="number of held-out episodes")
    parser.add_argument("--max-frames", type=int, default=1_000_000, help="limit of frames")
    parser.add_argument("--settings", default="{}", help="settings of the learner as JSON")
    return parser


if __name__ == "__main__":
    sys.stdout.write(json.dumps(measure(sys.argv[1:])) + "\n")
