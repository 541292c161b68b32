# pyright: reportArgumentType=false
# pyright: reportAttributeAccessIssue=false
# pyright: reportCallIssue=false
# (TorchRL annotates base_env to hold anything.)
"""Policies to look at: films of their flights, and dm_control's viewer."""

import logging
import os
from pathlib import Path
from typing import cast

import torch
from tensordict import TensorDict
from torchrl.envs.utils import ExplorationType, set_exploration_type

from drone_rl.config import AppearanceSettings
from drone_rl.envs import DroneEnv
from drone_rl.evaluation.video import film_episode, write_video
from drone_rl.policies.policy import Policy
from drone_rl.sim.composer_task import make_environment
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import legacy_seed

_log = logging.getLogger(__name__)


def film(
    policy: Policy,
    folder: Path,
    episodes: int,
    *,
    greedy: bool = True,
    seed: int = 0,
    device: str = "cpu",
    renderer: str = "raytrace",
    appearance: AppearanceSettings | None = None,
) -> list[Path]:
    """Writes videos of a policy in unseen worlds.

    Args:
        policy: Who flies.
        folder: Where the files go.
        episodes: Flights, one MP4 and one GIF each.
        greedy: Whether to take the most probable action instead of drawing one.
        seed: Root of the worlds' random streams.
        device: Where to draw.
        renderer: Who draws, see `drone_rl.sim.rendering.find_renderer`.
        appearance: How worlds look; as in the policy's training by default.

    Returns:
        The files.
    """
    files: list[Path] = []
    look = {} if appearance is None else {"appearance": appearance}
    with policy.flying(1, seed=seed, device=device, renderer=renderer, **look) as (env, actor):
        for episode in range(episodes):
            frames = list(film_episode(env, actor, greedy=greedy))
            files += write_video(frames, folder / f"episode_{episode}")
    for file in files:
        _log.info("written: %s", file)
    return files


def view(
    policy: Policy,
    *,
    greedy: bool = True,
    seed: int = 0,
    device: str = "cpu",
    renderer: str = "raytrace",
    appearance: AppearanceSettings | None = None,
) -> None:
    """Opens dm_control's viewer on the composer task, flown by a policy.

    The viewer shows the dm_control simulation; the policy sees the same poses drawn as in
    training.

    Raises:
        InputError: There is no display.
    """
    if not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise InputError("viewer=true needs a display, and there is none; leave it false to film")
    import dm_env
    from dm_control import viewer

    look = {} if appearance is None else {"appearance": appearance}
    env = policy.make_env(1, seed=seed, device=device, renderer=renderer, **look)
    base = cast(DroneEnv, env.base_env)
    actor, worlds = policy.make_actor(env, seed=seed), base.worlds
    shown = make_environment(
        worlds.task,
        worlds.camera,
        dynamics=worlds.dynamics,
        pixels=False,
        random_state=legacy_seed(seed),
        appearance=base.looks.settings,
    )
    kind = ExplorationType.DETERMINISTIC if greedy else ExplorationType.RANDOM

    @torch.no_grad()
    def act(timestep: dm_env.TimeStep) -> int:
        del timestep
        state = shown.task.state.to(worlds.device)
        pixels = worlds.render(state, appearance=shown.task.look)
        seen = env.transform(TensorDict({"pixels": pixels}, [1], device=worlds.device))
        with set_exploration_type(kind):
            return int(actor(seen)["action"])

    viewer.launch(shown, act, title="drone-rl play")
