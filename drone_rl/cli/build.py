"""From settings to objects, for every command alike."""

import functools
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import torch
from hydra.utils import get_method
from omegaconf import DictConfig, OmegaConf
from tensordict.nn import TensorDictModuleBase
from torchrl.envs import TransformedEnv

from drone_rl.collectors import EpisodeCollector, ThreadedCollector
from drone_rl.policies import PolicyNetwork, make_actor
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import Stream, torch_generator
from drone_rl.zoo import (
    PolicyDescription,
    describe,
    parse,
    policy_names,
    policy_path,
    read_policy,
)

if TYPE_CHECKING:
    from drone_rl.collectors.ray import RayEpisodeCollector


def policy_is_checkpoint(overrides: list[str]) -> list[str]:
    """Lets `policy=good` say `checkpoint=good`, in commands whose policy is trained already."""
    return [re.sub(r"^policy=", "checkpoint=", override) for override in overrides]


def build_env(
    description: PolicyDescription,
    num_envs: int,
    *,
    seed: int,
    device: str,
    pixels: bool = True,
    **kwargs: object,
) -> TransformedEnv:
    """The worlds that a policy is described to fly in, seen as it sees them."""
    return description.build_env(num_envs, seed=seed, device=device, pixels=pixels, **kwargs)


def build_network(
    description: PolicyDescription, env: TransformedEnv, *, seed: int
) -> PolicyNetwork:
    """The described network with the initial weights of a seed."""
    network = description.build_network(torch_generator(seed, Stream.POLICY_INIT))
    return network.to(env.device)


def build_collector(
    config: DictConfig,
) -> tuple["ThreadedCollector | RayEpisodeCollector", PolicyNetwork, dict[str, torch.Generator]]:
    """A training's worlds shared out to workers, the network in all of them, its random streams.

    Raises:
        InputError: There are no worlds or no workers.
    """
    worlds, workers = config.collector.num_envs, config.collector.num_threads
    if worlds < 1 or workers < 1:
        raise InputError(
            f"collector.num_envs={worlds} and collector.num_threads={workers} must be 1 or more"
        )
    return get_method(config.collector.make)(config)


def threaded_collector(
    config: DictConfig,
) -> tuple[ThreadedCollector, PolicyNetwork, dict[str, torch.Generator]]:
    """`collector=episodes`: the workers are threads of this process."""
    shares = _shares(config, is_one=config.device.startswith("cuda"))
    network, collectors, generators = None, [], {}
    for i in range(len(shares)):
        collector, network, actions = build_share(config, shares, i, network)
        collectors.append(collector)
        generators[f"actions_{i}"] = actions
    return ThreadedCollector(collectors), network, generators


def ray_collector(
    config: DictConfig,
) -> tuple["RayEpisodeCollector", PolicyNetwork, dict[str, torch.Generator]]:
    """`collector=ray`: the workers are processes of a Ray cluster."""
    from drone_rl.collectors.ray import RayEpisodeCollector  # slow to import, seldom needed

    shares = _shares(config)
    local, network, _ = build_share(config, [1], 0)
    local.shutdown()
    settings = plain(config)
    makers = [functools.partial(_remote_share, settings, shares, i) for i in range(len(shares))]
    collector = RayEpisodeCollector(
        makers,
        local.actor,
        network,
        address=config.collector.address,
        num_cpus=config.collector.num_cpus,
        max_lost_workers=config.collector.max_lost_workers,
        device=config.device,
    )
    return collector, network, {}


def build_share(
    config: DictConfig, shares: list[int], number: int, network: PolicyNetwork | None = None
) -> tuple[EpisodeCollector, PolicyNetwork, torch.Generator]:
    """One worker's worlds, with the network that all share, and the stream of its actions."""
    description = describe(plain(config))
    env = build_env(
        description,
        shares[number],
        seed=config.seed,
        device=config.device,
        first_world=sum(shares[:number]),
        num_shards=1,
    )
    network = network or build_network(description, env, seed=config.seed)
    actions = torch_generator(config.seed, Stream.ACTIONS, number=number, device=env.device)
    return EpisodeCollector(env, make_actor(network, env.action_spec, actions)), network, actions


def _remote_share(
    settings: dict[str, Any], shares: list[int], number: int
) -> tuple[EpisodeCollector, PolicyNetwork, torch.Generator]:
    """`build_share` from what can be sent."""
    return build_share(OmegaConf.create(settings), shares, number)


def _shares(config: DictConfig, is_one: bool = False) -> list[int]:
    """Worlds of each worker."""
    worlds = config.collector.num_envs
    workers = 1 if is_one else min(worlds, config.collector.num_threads)
    return [worlds // workers + (i < worlds % workers) for i in range(workers)]


def plain(config: DictConfig) -> dict[str, Any]:
    """Settings as plain values, every reference resolved."""
    return cast(dict[str, Any], OmegaConf.to_container(config, resolve=True))


def find_checkpoint(where: str, outputs: str) -> Path:
    """The checkpoint file that the user means.

    Args:
        where: A .pt or .safetensors file, the folder of a run (its `last.pt`, in every command),
            "latest" for the newest run, or the name of a policy that travels with the package.
        outputs: Folder under which runs are kept.

    Raises:
        InputError: There is none.
    """
    if where == "latest":
        found = sorted(
            Path(outputs).glob("train/**/checkpoints/last.pt"), key=lambda p: p.stat().st_mtime
        )
        if not found:
            raise InputError(
                f"checkpoint=latest, but there is no run under {outputs}/train; "
                "run drone-rl train first or give the path of a checkpoint"
            )
        return found[-1]
    if where in policy_names():
        return policy_path(where)
    path = Path(where)
    if not path.exists():
        raise InputError(
            f"policy or checkpoint {where} does not exist; give a file, the folder of a run, "
            f"latest, or one of {', '.join(policy_names())}"
        )
    return path / "checkpoints" / "last.pt" if path.is_dir() else path


def load_trained(
    path: Path,
    num_envs: int,
    *,
    task: dict[str, Any],
    seed: int,
    device: str,
    stream: Stream = Stream.REPORT,
) -> tuple[TransformedEnv, TensorDictModuleBase, dict[str, Any]]:
    """A checkpoint's policy, in held-out worlds like those that it was trained in.

    Args:
        path: The checkpoint.
        num_envs: Number of worlds.
        task: Settings that replace the checkpoint's own; None keeps them.
        seed: Root of the worlds' random streams.
        device: Where to run.
        stream: Worlds to report on, or those to choose by.

    Returns:
        The environment, the actor and what `read_policy` says.

    Raises:
        InputError: The checkpoint or a setting is unusable.
    """
    state = read_policy(path)
    description = trained_config(state, task)
    env = build_env(description, num_envs, seed=seed, stream=stream, device=device)
    network = build_network(description, env, seed=seed)
    network.load_state_dict(state["policy"])
    actions = torch_generator(seed, stream, device=env.device)
    return env, make_actor(network, env.action_spec, actions), state


def trained_config(state: dict[str, Any], task: dict[str, Any]) -> PolicyDescription:
    """What a file says of its policy; what `task` gives replaces the task's settings.

    Raises:
        InputError: A setting of the task is unknown or out of range.
    """
    described = state["description"]
    changed = {k: v for k, v in task.items() if v is not None}
    return parse({**described, "task": {**described["task"], **changed}})
