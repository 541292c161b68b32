# pyright: reportArgumentType=false
# pyright: reportAttributeAccessIssue=false
# (TensorDict's entries are annotated as tensors or TensorDicts, its keys as single names.)
"""Flies a policy and records what it saw, did, and what was there in truth.

Whole episodes are flown, and of each about as many frames are drawn and analysed: evenly spread
over the episode, so that one that circles for hundreds of steps counts no more than another.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from tensordict import TensorDict, TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torch import Tensor
from torchrl.envs import TransformedEnv
from torchrl.envs.utils import ExplorationType, set_exploration_type

from drone_rl.collectors import EpisodeCollector
from drone_rl.envs import worlds_of
from drone_rl.explanations.dataset import SEEN, RolloutDataset, flown_fields
from drone_rl.explanations.hooks import features, probabilities
from drone_rl.explanations.scenes import Scenes
from drone_rl.policies import PictureNetwork
from drone_rl.sim.actions import Actions
from drone_rl.sim.tasks import Task
from drone_rl.utils.errors import InputError

_POSE = ("drone", "attitude")


def record(
    env: TransformedEnv,
    actor: TensorDictModuleBase,
    network: PictureNetwork,
    num_frames: int,
    *,
    num_episodes: int = 1,
    layers: tuple[str, ...] = (),
    greedy: bool = False,
    meta: dict[str, Any] | None = None,
) -> RolloutDataset:
    """Flies, and draws frames spread over all episodes; see `fly`, `spread` and `draw`.

    Raises:
        InputError: No frames are asked for, or a layer doesn't exist.
    """
    flights = fly(
        env, actor, num_episodes=num_episodes, num_frames=num_frames, greedy=greedy, meta=meta
    )
    return draw(flights, spread(flights.episode, num_frames), Scenes(env), network, layers)


def fly(
    env: TransformedEnv,
    actor: TensorDictModuleBase,
    *,
    num_episodes: int,
    num_frames: int = 1,
    greedy: bool = False,
    meta: dict[str, Any] | None = None,
) -> RolloutDataset:
    """Flies whole episodes and draws nothing but what the policy looks at.

    Args:
        env: A batch of worlds.
        actor: The policy.
        num_episodes: At least so many.
        num_frames: And at least so many frames.
        greedy: Whether to take the most probable action instead of drawing one.
        meta: Where the policy comes from.

    Returns:
        All frames, with `flown_fields` and "observations".

    Raises:
        InputError: No frames are asked for.
    """
    if num_frames < 1:
        raise InputError(f"frames={num_frames} records nothing; give 1 or more")
    worlds = worlds_of(env)
    keep = (("next", "info", "end_reason"),)
    collector = EpisodeCollector(env, _WithTruth(actor, (*worlds.task.entries, *_POSE)), keep=keep)
    kind = ExplorationType.DETERMINISTIC if greedy else ExplorationType.RANDOM
    batches = []
    with set_exploration_type(kind):
        while collector.episodes < num_episodes or collector.frames < num_frames:
            missing = num_episodes - collector.episodes
            batches.append(collector.collect(missing if missing > 0 else None))
    fields = flown_fields(worlds.task, worlds.dynamics.actions)
    described = {**fields, "observations": SEEN["observations"]}
    about = {"greedy": greedy, **(meta or {}), "fields": described}
    arrays = _arrays(torch.cat(batches), worlds.task, worlds.dynamics.actions)
    return RolloutDataset(arrays, {}, about)


def spread(episode: NDArray, num_frames: int) -> NDArray:
    """Chooses frames: of each episode as many, as far as it has them, evenly spaced in time.

    Args:
        episode: The episode of each frame, from 0, in order. Shape: (T,).
        num_frames: How many; all if there are fewer.

    Returns:
        Their numbers, in order. Shape: (num_frames,).
    """
    lengths = np.bincount(episode)
    quota = np.zeros_like(lengths)
    while (left := min(num_frames, len(episode)) - quota.sum()) > 0:
        hungry = np.flatnonzero(quota < lengths)[:left]
        more = max(1, left // len(hungry))
        quota[hungry] = np.minimum(lengths[hungry], quota[hungry] + more)
    firsts = lengths.cumsum() - lengths
    return np.concatenate(
        [
            first + ((np.arange(count) + 0.5) * length / max(count, 1)).astype(int)
            for first, length, count in zip(firsts, lengths, quota, strict=True)
        ]
    )


def draw(
    flights: RolloutDataset,
    rows: NDArray,
    scenes: Scenes,
    network: PictureNetwork,
    layers: tuple[str, ...] = (),
) -> RolloutDataset:
    """Some frames of flights, with all that can be known about them.

    Args:
        flights: From `fly`.
        rows: Frames. Shape: (T,).
        scenes: Where they are drawn.
        network: The policy's.
        layers: Layers whose output is recorded.

    Raises:
        InputError: A layer doesn't exist.
    """
    arrays = {name: value[rows] for name, value in flights.arrays.items()}
    fields = {**flights.meta["fields"], **SEEN}
    dataset = RolloutDataset(arrays, {}, {**flights.meta, "fields": fields})
    worlds = scenes.worlds
    state = dataset.state(worlds.task, worlds.dynamics).to(worlds.device)
    observations = dataset.tensor("observations")
    arrays["frames"] = scenes.frames(state).cpu().numpy()
    arrays["regions"] = scenes.regions(state).cpu().numpy()
    arrays["depth"] = scenes.depth(state).cpu().numpy().astype(np.float16)
    arrays["probabilities"] = probabilities(network, observations).cpu().numpy()
    for layer in layers:
        dataset.features[layer] = features(network, observations, layer).cpu().numpy()
    return dataset


class _WithTruth(TensorDictModuleBase):
    """An actor that also lets the simulator's truth through, so that it is recorded."""

    def __init__(self, actor: TensorDictModuleBase, names: tuple[str, ...]) -> None:
        super().__init__()
        self.actor = actor
        self.in_keys = [*actor.in_keys, *(("info", name) for name in names)]
        self.out_keys = actor.out_keys

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Acts."""
        return self.actor(tensordict)


def _arrays(batch: TensorDictBase, task: Task[Any], actions: Actions) -> dict[str, NDArray]:
    info: TensorDict = batch["info"]
    episode = batch["collector", "traj_ids"]
    starts = torch.cat([episode.new_ones(1, dtype=torch.bool), episode[1:] != episode[:-1]])
    first = starts.nonzero()[:, 0][starts.cumsum(0) - 1]
    arrays = {
        "observations": batch["pixels"],
        **actions.kept(batch["action"]),
        "rewards": batch["next", "reward"][:, 0],
        "event": _events(task, info, starts, batch["next", "info", "end_reason"][:, 0]),
        **{name: info[name] for name in _POSE},
        **task.remember(info),
        "episode": starts.cumsum(0) - 1,
        "step": torch.arange(len(batch), device=episode.device) - first,
        "end_reason": batch["next", "info", "end_reason"][:, 0],
    }
    return {name: value.cpu().numpy() for name, value in arrays.items()}


def _events(
    task: Task[Any], info: Mapping[str, Tensor], starts: Tensor, end_reason: Tensor
) -> Tensor:
    """What actions do: 1 where a goal is reached, -1 where one is missed, else 0. Shape: (T,)."""
    is_last = torch.cat([starts[1:], starts.new_ones(1)])
    reached, missed = (
        torch.where(is_last, 0, torch.diff(count, append=count[-1:])) for count in task.tally(info)
    )
    is_reached = (reached > 0) | (is_last & (end_reason == task.success_end))
    return torch.where(is_reached, 1, -(missed > 0).long()).to(torch.int8)
