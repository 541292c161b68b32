"""`drone-rl verdict`."""

import json
import logging
from pathlib import Path

from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig
from tensordict.nn import TensorDictModuleBase
from torchrl.envs import EnvBase

from drone_rl.cli.build import find_checkpoint, load_trained, plain, policy_is_checkpoint
from drone_rl.envs import DroneEnv
from drone_rl.sim.settings import TaskSettings
from drone_rl.utils.errors import InputError
from drone_rl.utils.provenance import provenance
from drone_rl.utils.seeding import Stream, torch_generator
from drone_rl.verdicts.judge import judge_policy
from drone_rl.verdicts.luck import BASELINES, make_baseline
from drone_rl.verdicts.rule import Rule

prepare = policy_is_checkpoint
_log = logging.getLogger(__name__)


def run(config: DictConfig) -> tuple[int, str]:
    """Judges one policy. Returns the verdict's exit status and the kind's name."""
    check_episodes(config)
    folder = Path(HydraConfig.get().runtime.output_dir)
    rule = Rule(good_share=config.good_share)
    env, actor = _policy(config, min(config.num_envs, config.episodes))
    draws = config.sampled and config.checkpoint not in BASELINES
    verdict = judge_policy(env, actor, config.episodes, rule=rule, sampled=draws)
    env.close()
    report = {"policy": config.checkpoint, **verdict.as_dict(), **provenance()}
    (folder / "verdict.json").write_text(json.dumps(report, indent=2))
    print(f"{verdict.kind.value}{'' if verdict.certain else ' (not certain)'}: {verdict.sentence}")
    _log.info("written: %s", folder / "verdict.json")
    return verdict.exit_code, verdict.kind.value


def check_episodes(config: DictConfig) -> None:
    """Refuses to fly nothing.

    Raises:
        InputError: `episodes` or `num_envs` is below 1.
    """
    if config.episodes < 1 or config.num_envs < 1:
        raise InputError(
            f"episodes={config.episodes} and num_envs={config.num_envs} must be 1 or more"
        )


def _policy(config: DictConfig, num_envs: int) -> tuple[EnvBase, TensorDictModuleBase]:
    task, seed, device = plain(config.task), config.seed, config.device
    if config.checkpoint not in BASELINES:
        path = find_checkpoint(config.checkpoint, config.paths.outputs)
        env, actor, _ = load_trained(path, num_envs, task=task, seed=seed, device=device)
        return env, actor
    settings = TaskSettings(**{k: v for k, v in task.items() if v is not None})
    env = DroneEnv(num_envs, settings, seed=seed, stream=Stream.REPORT, pixels=False, device=device)
    generator = torch_generator(seed, Stream.ACTIONS, device=env.device)
    return env, make_baseline(config.checkpoint, settings, generator)
