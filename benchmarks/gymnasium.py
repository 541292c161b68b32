"""Speed of the Gymnasium vector environment relative to the batched TorchRL environment."""

import numpy as np

from benchmarks.benchmark import Setup
from benchmarks.pipeline import make_drone_env, paired, random_walk
from drone_rl.utils.errors import extra

_STEPS = 10
"""Steps of a batch in a call of `walk`."""


def bench_gymnasium(setup: Setup) -> dict[str, float]:
    """Take random actions in both environments alternately and count all observations.

    Returns:
        "gym_over_batched", the median ratio of all rounds; "gym_fps" and
        "batched_beside_gym_fps", the frames per second of both.

    Raises:
        InputError: Gymnasium is not installed.
    """
    extra("gymnasium", "gym", "drone-rl bench gymnasium")
    from drone_rl.envs.gymnasium.environments import DroneWorlds

    vector, env = (
        DroneWorlds(setup.num_envs, device=setup.device),
        make_drone_env(setup.num_envs, setup.device),
    )
    rng = np.random.default_rng(0)
    vector.reset(seed=0)

    def walk() -> int:
        for _ in range(_STEPS):
            vector.step(rng.integers(0, 3, setup.num_envs))
        return _STEPS * setup.num_envs

    for work in (walk, lambda: random_walk(env, _STEPS)):
        work()
    ours, batched, ratio = paired(
        walk,
        lambda: random_walk(env, _STEPS),
        seconds=0.5 if setup.quick else 4.0,
        rounds=1 if setup.quick else 9,
    )
    vector.close()
    env.close()
    return {"gym_over_batched": ratio, "gym_fps": ours, "batched_beside_gym_fps": batched}
