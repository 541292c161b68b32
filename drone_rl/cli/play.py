"""`drone-rl play`."""

import logging
import os
from pathlib import Path

import dm_env
import torch
from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig
from tensordict import TensorDict
from torchrl.envs.utils import ExplorationType, set_exploration_type

from drone_rl.cli.build import find_checkpoint, load_trained, plain, policy_is_checkpoint
from drone_rl.evaluation.video import film_episode, write_video
from drone_rl.sim.composer_task import make_environment
from drone_rl.utils.errors import InputError

prepare = policy_is_checkpoint
_log = logging.getLogger(__name__)


def run(config: DictConfig) -> tuple[int, None]:
    """Films a policy. Returns the exit status."""
    if config.episodes < 1:
        raise InputError(f"episodes={config.episodes} is out of range; give 1 or more")
    path = find_checkpoint(config.checkpoint, config.paths.outputs)
    if config.viewer:
        _view(config, path)
    else:
        folder = Path(HydraConfig.get().runtime.output_dir)
        film(config, path, folder, config.episodes)
    return 0, None


def film(config: DictConfig, path: Path, folder: Path, episodes: int) -> None:
    """Writes videos of a checkpoint's policy on held-out worlds."""
    task = plain(config.task)
    env, actor, _ = load_trained(path, 1, task=task, seed=config.seed, device=config.device)
    for episode in range(episodes):
        frames = list(film_episode(env, actor, greedy=config.greedy))
        for file in write_video(frames, folder / f"episode_{episode}"):
            _log.info("written: %s", file)
    env.close()


def _view(config: DictConfig, path: Path) -> None:
    """Opens dm_control's viewer on the composer task, flown by the checkpoint's policy.

    The viewer shows the dm_control simulation; the policy sees the same poses drawn by Warp, as
    it did in training.
    """
    if not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise InputError("viewer=true needs a display, and there is none; leave it false to film")
    from dm_control import viewer

    task = plain(config.task)
    env, actor, _ = load_trained(path, 1, task=task, seed=config.seed, device=config.device)
    worlds = env.base_env.worlds
    shown = make_environment(worlds.task, worlds.camera, pixels=False, random_state=config.seed)
    kind = ExplorationType.DETERMINISTIC if config.greedy else ExplorationType.RANDOM

    @torch.no_grad()
    def policy(timestep: dm_env.TimeStep) -> int:
        del timestep
        pixels = worlds.render(shown.task.state.to(worlds.device))
        seen = env.transform(TensorDict({"pixels": pixels}, [1], device=worlds.device))
        with set_exploration_type(kind):
            return int(actor(seen)["action"])

    viewer.launch(shown, policy, title="drone-rl play")
