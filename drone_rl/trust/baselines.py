"""Run the baselines of a task in the same environments as a policy."""

from collections.abc import Mapping
from typing import Any

import torch

from drone_rl.collectors.complete_episodes import CompleteEpisodes, rollout
from drone_rl.config import BaseTaskSettings
from drone_rl.envs import DroneEnv
from drone_rl.policies.baselines import baseline_names, make_baseline
from drone_rl.sim.dynamics import Dynamics
from drone_rl.sim.tasks import Task, as_task
from drone_rl.trust.rule import BLIND_BASELINES, USABLE

BASELINES = (*BLIND_BASELINES, "oracle")
"""Baselines by name; some tasks have no oracle."""
_RANDOM_ACTIONS = 5
"""Key of the random actions' stream, derived from that of the first environment."""


def run_baselines(
    num_envs: int,
    task: BaseTaskSettings | Task[Any],
    worlds: dict[str, Any],
    episodes: int,
    device: str = "cpu",
    dynamics: Dynamics | None = None,
) -> dict[str, CompleteEpisodes]:
    """Run so many episodes of every baseline, the k-th of each from the same initial state.

    "oracle" is among them if the task has one for the drones' actions.

    `worlds` is `DroneEnv.state_dict` from before the policy's first episode, and `num_envs` the
    policy's batch size. The task's default dynamics are used by default.

    Raises:
        InputError: The drones lack an action of a baseline; no episode was run.
    """
    task = as_task(task)
    env = DroneEnv(num_envs, task, pixels=False, device=device, dynamics=dynamics)
    actions = env.worlds.dynamics.actions
    env.load_state_dict(worlds)
    source = env.side_streams(torch.tensor([0]), _RANDOM_ACTIONS)[0]
    generator = torch.Generator(env.device).manual_seed(int(source.integers(2**63)))
    names = baseline_names(task, actions)
    agents = {name: make_baseline(name, task, actions, generator) for name in names}
    results = {}
    for name, agent in agents.items():
        env.load_state_dict(worlds)
        results[name] = rollout(agent, env, episodes)
    env.close()
    return results


def reference(baselines: Mapping[str, CompleteEpisodes]) -> CompleteEpisodes | None:
    """Return the oracle's episodes, None without an oracle that succeeds often enough."""
    oracle = baselines.get("oracle")
    is_usable = oracle is not None and float(oracle.success.mean()) > USABLE
    return oracle if is_usable else None
