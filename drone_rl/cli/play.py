"""`drone-rl play`."""

import logging
from pathlib import Path
from typing import Any

from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig, OmegaConf

from drone_rl.cli.build import find_checkpoint, load_trained
from drone_rl.evaluation.video import film_episode, write_video
from drone_rl.utils.errors import InputError

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
    task: dict[str, Any] = OmegaConf.to_container(config.task, resolve=True)
    env, actor, _ = load_trained(path, 1, task=task, seed=config.seed, device=config.device)
    for episode in range(episodes):
        frames = list(film_episode(env, actor, greedy=config.greedy))
        for file in write_video(frames, folder / f"episode_{episode}"):
            _log.info("written: %s", file)
    env.close()


def _view(config: DictConfig, path: Path) -> None:
    """Opens dm_control's viewer on the composer task, flown by the checkpoint's policy."""
    raise NotImplementedError
