"""One training of Stable-Baselines3's in a process of its own, so that its start counts.

    python -m drone_rl.bench.peers_sb3 ppo --seed 100 --episodes 1000 --started "$(date +%s.%N)"

It prints a line of JSON: "seconds" from the start of the process until it is solved,
"seconds_without_imports", "frames", "episodes", "is_solved", "running_reward", and of as many
held-out greedy episodes as were asked for "success" and "success_lower95".
"""

import argparse
import dataclasses
import json
import sys
import time
from collections.abc import Sequence
from typing import Any

from drone_rl.utils.extras import extra


def measure(arguments: Sequence[str]) -> dict[str, Any]:
    """Trains, and looks at the clock.

    Args:
        arguments: Of the program.

    Returns:
        What it prints.

    Raises:
        InputError: Stable-Baselines3 isn't installed, or a setting can't be.
    """
    began = time.time()
    given = _parser().parse_args(arguments)
    extra("stable_baselines3", "sb3", "python -m drone_rl.bench.peers_sb3")
    import drone_rl
    from drone_rl.api.progress import silent
    from drone_rl.bench.sb3_training import train_sb3

    settings = json.loads(given.settings)
    imported = time.time()
    done = train_sb3(given.algorithm, given.seed, max_frames=given.max_frames, **settings)
    solved = time.time()
    told = {f.name: getattr(done, f.name) for f in dataclasses.fields(done) if f.name != "policy"}
    times = {
        "seconds": solved - (began if given.started is None else given.started),
        "seconds_without_imports": solved - imported,
    }
    if not given.episodes:
        return {**times, **told}
    flown = drone_rl.evaluate(
        done.policy, episodes=given.episodes, baselines=False, progress=silent
    ).flown["greedy"]["success"]
    return {**times, **told, "success": flown["share"], "success_lower95": flown["lower95"]}


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m drone_rl.bench.peers_sb3")
    parser.add_argument("algorithm", help="ppo or a2c")
    parser.add_argument("--seed", type=int, default=0, help="of worlds, weights and actions")
    parser.add_argument("--started", type=float, help="when the process began, as time.time()")
    parser.add_argument("--episodes", type=int, default=0, help="held-out ones to fly afterwards")
    parser.add_argument("--max-frames", type=int, default=1_000_000, help="to stop after")
    parser.add_argument(
        "--settings", default="{}", help="of the algorithm, or num_envs, target, environment: JSON"
    )
    return parser


if __name__ == "__main__":
    sys.stdout.write(json.dumps(measure(sys.argv[1:])) + "\n")
