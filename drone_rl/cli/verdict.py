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
from drone_rl.evaluation import ConstantPolicy, Oracle, RandomPolicy, run_episodes, summarise
from drone_rl.explain.verdict import judge_policy
from drone_rl.sim.rules import Action
from drone_rl.sim.settings import TaskSettings
from drone_rl.utils.errors import InputError
from drone_rl.utils.provenance import provenance
from drone_rl.utils.seeding import Stream, torch_generator

BASELINES = ("random", "oracle", *(action.name.lower() for action in Action))
"""Policies that are no network."""

prepare = policy_is_checkpoint
_log = logging.getLogger(__name__)


def run(config: DictConfig) -> tuple[int, str]:
    """Judges one policy. Returns the verdict's exit status and its name."""
    if config.episodes < 1 or config.num_envs < 1:
        raise InputError(
            f"episodes={config.episodes} and num_envs={config.num_envs} must be 1 or more"
        )
    folder = Path(HydraConfig.get().runtime.output_dir)
    env, actor = _policy(config, min(config.num_envs, config.episodes))
    num_cubes = getattr(env, "base_env", env).worlds.settings.num_cubes
    summary = summarise(run_episodes(env, actor, config.episodes, greedy=config.greedy))
    env.close()
    verdict = judge_policy(summary, num_cubes)
    report = {
        "policy": config.checkpoint,
        **verdict.as_dict(),
        "evaluation": summary,
        **provenance(),
    }
    (folder / "verdict.json").write_text(json.dumps(report, indent=2))
    certainty = "" if verdict.certain else " (not certain: give more episodes)"
    print(f"{verdict.kind.value}{certainty}: {verdict.sentence}")
    _log.info("written: %s", folder / "verdict.json")
    return verdict.kind.exit_code, verdict.kind.value


def _policy(config: DictConfig, num_envs: int) -> tuple[EnvBase, TensorDictModuleBase]:
    task = plain(config.task)
    if config.checkpoint not in BASELINES:
        path = find_checkpoint(config.checkpoint, config.paths.outputs)
        env, actor, _ = load_trained(
            path, num_envs, task=task, seed=config.seed, device=config.device
        )
        return env, actor
    settings = TaskSettings(**{k: v for k, v in task.items() if v is not None})
    env = DroneEnv(
        num_envs,
        settings,
        seed=config.seed,
        stream=Stream.REPORT,
        pixels=False,
        device=config.device,
    )
    if config.checkpoint == "oracle":
        return env, Oracle(settings)
    if config.checkpoint == "random":
        generator = torch_generator(config.seed, Stream.ACTIONS, device=env.device)
        return env, RandomPolicy(len(Action), generator)
    return env, ConstantPolicy(Action[config.checkpoint.upper()])
