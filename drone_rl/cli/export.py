"""`drone-rl export`."""

import logging
import shlex
from pathlib import Path

from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig

from drone_rl.cli.build import find_checkpoint, load_trained, policy_is_checkpoint
from drone_rl.evaluation import run_episodes, summarise
from drone_rl.utils.errors import InputError
from drone_rl.utils.overrides import read_overrides
from drone_rl.zoo import COMMAND, export_policy

prepare = policy_is_checkpoint
_log = logging.getLogger(__name__)


def run(config: DictConfig) -> tuple[int, str]:
    """Exports one policy. Returns the exit status and the file's path."""
    if config.episodes < 1 or config.num_envs < 1:
        raise InputError(
            f"episodes={config.episodes} and num_envs={config.num_envs} must be 1 or more"
        )
    if config.command is not None:
        COMMAND.read(config.command, "command")
    path = find_checkpoint(config.checkpoint, config.paths.outputs)
    num_envs = min(config.num_envs, config.episodes)
    env, actor, state = load_trained(
        path, num_envs, task={}, seed=config.seed, device=config.device
    )
    evaluation = summarise(run_episodes(env, actor, config.episodes))
    env.close()
    target = Path(HydraConfig.get().runtime.output_dir) / f"{config.name}.safetensors"
    command = config.command or state.get("command") or _training_command(path)
    export_policy(target, state, command=command, evaluation=evaluation)
    _log.info("written: %s and %s", target, target.with_suffix(".md").name)
    return 0, str(target)


def _training_command(path: Path) -> str:
    """The command of the run that wrote a checkpoint, as Hydra noted it."""
    return shlex.join(["drone-rl", "train", *read_overrides(path.absolute().parents[1])])
