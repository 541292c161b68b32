"""Frames a second of the Gymnasium vector environment over the batched environment itself."""

import numpy as np

from benchmarks.pipeline import make_worlds, paired, random_walk
from drone_rl.utils.errors import extra

_STEPS = 10
"""Of a batch between two looks at the clock."""


def bench_gymnasium(num_envs: int, device: str, quick: bool) -> dict[str, float]:
    """Random actions in both by turns; each frame that is observed counts, those of resets too.

    Args:
        num_envs: Worlds in each batch.
        device: Where they are drawn.
        quick: Whether a rough figure will do.

    Returns:
        "gym_over_batched", the median ratio of rounds, and both rates: "gym_fps" and
        "batched_beside_gym_fps".

    Raises:
        InputError: Gymnasium isn't installed.
    """
    extra("gymnasium", "gym", "drone-rl bench gymnasium")
    from drone_rl.envs.gymnasium.environments import DroneWorlds

    worlds, env = DroneWorlds(num_envs, device=device), make_worlds(num_envs, device)
    draw = np.random.default_rng(0)
    worlds.reset(seed=0)

    def walk() -> int:
        for _ in range(_STEPS):
            worlds.step(draw.integers(0, 3, num_envs))
        return _STEPS * num_envs

    for work in (walk, lambda: random_walk(env, _STEPS)):
        work()
    ours, batched, ratio = paired(
        walk,
        lambda: random_walk(env, _STEPS),
        seconds=0.5 if quick else 4.0,
        rounds=1 if quick else 9,
    )
    worlds.close()
    env.close()
    return {"gym_over_batched": ratio, "gym_fps": ours, "batched_beside_gym_fps": batched}
