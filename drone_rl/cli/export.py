"""`drone-rl export`."""

import logging
import shlex
from pathlib import Path
from typing import Any

from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig

from drone_rl.cli.build import find_checkpoint, load_trained, policy_is_checkpoint
from drone_rl.sweeps import read_sweep
from drone_rl.sweeps.rows import read_rows
from drone_rl.utils.errors import InputError
from drone_rl.utils.overrides import COMMAND, read_overrides
from drone_rl.verdicts.judge import judge_policy
from drone_rl.zoo import export_policy

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
    try:
        verdict = judge_policy(env, actor, config.episodes).as_dict()
    finally:
        env.close()
    command, chosen = _origin(path, state)
    target = Path(HydraConfig.get().runtime.output_dir) / f"{config.name}.safetensors"
    export_policy(
        target,
        state,
        command=config.command or command,
        verdict=verdict,
        seed=config.seed,
        chosen=chosen,
    )
    _log.info("written: %s and %s", target, target.with_suffix(".md").name)
    return 0, str(target)


def _origin(path: Path, state: dict[str, Any]) -> tuple[str, dict[str, Any] | None]:
    """The command that trains the same once more, and the choice in a sweep, if it is of one."""
    folder = path.absolute().parent.parent
    if path.suffix == ".pt" and (folder.parent / "sweep.json").is_file():
        rows = read_rows(read_sweep(folder.parent))
        row = next((row for row in rows if row.run.folder == folder), None)
        if row is not None:
            episodes = None if row.verdict is None else row.verdict["greedy"]["episodes"]
            return row.run.repeat_command(), {"runs": len(rows), "episodes": episodes}
    noted = state.get("command") or shlex.join(["drone-rl", "train", *read_overrides(folder)])
    return noted, state.get("chosen")
