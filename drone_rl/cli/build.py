"""From settings to objects, for every command alike."""

from pathlib import Path
from typing import Any

import torch
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf
from tensordict.nn import TensorDictModuleBase
from torchrl.envs import TransformedEnv

from drone_rl.envs import DroneEnv, make_env
from drone_rl.policies import PolicyNetwork, make_actor
from drone_rl.sim.settings import CameraSettings, TaskSettings
from drone_rl.training import load_checkpoint, load_policy
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import Stream, torch_generator


def build_env(
    config: DictConfig,
    num_envs: int,
    *,
    seed: int,
    device: str,
    stream: Stream = Stream.WORLDS,
    num_shards: int | None = None,
) -> TransformedEnv:
    """The worlds of `config.task` seen through `config.camera` and `config.transforms`."""
    task: TaskSettings = instantiate(config.task)
    camera: CameraSettings = instantiate(config.camera)
    transforms = [instantiate(t) for t in config.transforms.values() if t is not None]
    env = DroneEnv(
        num_envs, task, camera, seed=seed, stream=stream, num_shards=num_shards, device=device
    )
    return make_env(env, transforms)


def build_policy(
    config: DictConfig, env: TransformedEnv, *, seed: int
) -> tuple[PolicyNetwork, TensorDictModuleBase, torch.Generator]:
    """A network sized by the environment's specs, its actor, and the stream its actions draw on."""
    network: PolicyNetwork = instantiate(config.policy)(
        tuple(env.observation_spec["pixels"].shape[1:]),
        env.action_spec.space.n,
        generator=torch_generator(seed, Stream.POLICY_INIT),
    ).to(env.device)
    actions = torch_generator(seed, Stream.ACTIONS, env.device)
    return network, make_actor(network, env.action_spec, actions), actions


def find_checkpoint(where: str, outputs: str) -> Path:
    """The checkpoint file that the user means.

    Args:
        where: A .pt file, the folder of a run, or "latest" for the newest run.
        outputs: Folder under which runs are kept.

    Raises:
        InputError: There is none.
    """
    if where == "latest":
        found = sorted(
            Path(outputs).glob("train/**/checkpoints/best.pt"), key=lambda p: p.stat().st_mtime
        )
        if not found:
            raise InputError(
                f"checkpoint=latest, but there is no run under {outputs}/train; "
                "run drone-rl train first or give the path of a checkpoint"
            )
        return found[-1]
    path = Path(where)
    return path / "checkpoints" / "best.pt" if path.is_dir() else path


def load_trained(
    path: Path, num_envs: int, *, task: dict[str, Any], seed: int, stream: Stream, device: str
) -> tuple[TransformedEnv, TensorDictModuleBase, dict[str, Any]]:
    """A checkpoint's policy, in worlds like those that it was trained in.

    Args:
        path: The checkpoint.
        num_envs: Number of worlds.
        task: Settings that replace the checkpoint's own.
        seed: Root of the worlds' random streams.
        stream: What the worlds are for.
        device: Where to run.

    Returns:
        The environment, the actor and the checkpoint's state.
    """
    state = load_checkpoint(path)
    config = OmegaConf.create(state["config"])
    unknown = sorted(set(task) - set(config.task))
    if unknown:
        raise InputError(
            f"task.{unknown[0]} is not a setting of the task; choose from: "
            f"{', '.join(k for k in config.task if k != '_target_')}"
        )
    config.task.update(task)
    env = build_env(config, num_envs, seed=seed, stream=stream, device=device)
    network, actor, _ = build_policy(config, env, seed=seed)
    load_policy(network, state["policy"])
    return env, actor, state
