"""Recorded rollouts of a policy with the simulator's ground truth, and rollouts from given states.

Only some frames of each episode are rendered and analysed, evenly spread, so that a long episode
counts no more than a short one.
"""

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from tensordict import TensorDict
from tensordict.nn import TensorDictModuleBase
from torch import Tensor
from torchrl.envs import EnvBase

from drone_rl.collectors.complete_episodes import rollout
from drone_rl.envs.rollout import ActorAgent, Recording, Step, steps
from drone_rl.explanations.hooks import entries_of, features, memory_in, probabilities, rest_in
from drone_rl.explanations.scenes import Scenes
from drone_rl.policies import ImageNetwork, RecurrentNetwork, greedy_agent
from drone_rl.sim.rendering import Appearance
from drone_rl.sim.tasks import Goals, State, Task
from drone_rl.sim.worlds import Worlds

_POSE = ("drone", "attitude")
_INPUT = "inputs/"
"""Begin of the names of the arrays that hold the policy's inputs but the observations."""
_STATE = "state/"
"""Begin of the names of the arrays that hold the environments' states."""
_SAME = 1e-9  # poses (metres, quaternion) that differ by less are equal up to rounding


@dataclasses.dataclass
class RolloutDataset:
    """Steps of episodes in order of time, as arrays by name; see docs/reference/files.md.

    Frames, regions, depth, probabilities and "features/..." are those of `render_frames` only.
    """

    arrays: dict[str, NDArray]

    def __len__(self) -> int:
        return len(self.arrays["actions"])

    def __getattr__(self, name: str) -> NDArray:
        if name in (arrays := vars(self).get("arrays", {})):
            return arrays[name]
        raise AttributeError(name)

    def tensor(self, name: str) -> Tensor:
        """Return an array as a tensor."""
        return torch.from_numpy(self.arrays[name])

    @property
    def memory(self) -> Tensor | None:
        """Memory of a recurrent policy before each step, see `hooks`; None of others."""
        return self.tensor("memory") if "memory" in self.arrays else None

    @property
    def rest(self) -> Tensor | None:
        """What else the policy reads besides the observations, see `hooks`; None if nothing."""
        return self.memory if self.memory is not None else rest_in(self.others)

    @property
    def others(self) -> dict[str, Tensor]:
        """The policy's other inputs by name, in order. Shapes: (T, *)."""
        names = [name for name in self.arrays if name.startswith(_INPUT)]
        return {name.removeprefix(_INPUT): self.tensor(name) for name in names}

    def offset(self, worlds: Worlds) -> NDArray:
        """Return how far ahead of the drone and to its left the next target stands. (T, 2).

        Metres; NaN if there is none.
        """
        if worlds.task.edits is None:
            return np.full((len(self), 2), np.nan)
        return worlds.task.edits.next_offset(self.state(worlds))[:, :2].cpu().numpy()

    def state(self, worlds: Worlds) -> State:
        """Return the recorded states (T) of environments like those of `worlds`."""
        names = [name for name in self.arrays if name.startswith(_STATE)]
        kept = TensorDict({name.removeprefix(_STATE): self.tensor(name) for name in names})
        return worlds.state.with_tensors(kept.unflatten_keys("/").to_dict())

    def save(self, path: str | Path, flights: "RolloutDataset") -> None:
        """Write the file, with all steps of the episodes as "flights/..."."""
        arrays: dict[str, Any] = dict(self.arrays)  # Any: numpy's allow_pickle
        whole = flights.arrays.items()
        left_out = ("observations", _INPUT)  # they are large
        arrays |= {f"flights/{n}": value for n, value in whole if not n.startswith(left_out)}
        np.savez_compressed(path, **arrays)


def collect(
    env: EnvBase,
    actor: TensorDictModuleBase,
    *,
    num_episodes: int,
    num_frames: int = 1,
    observations: str | None = None,
) -> RolloutDataset:
    """Collect at least so many whole episodes and steps of a policy, with sampled actions.

    Only inputs of the policy are rendered. `observations` names the one that is explained, by
    default the first image, if any.
    """
    scenes = Scenes(env, observations)
    worlds = scenes.worlds
    task, actions = worlds.task, worlds.dynamics.actions
    truth = (*task.scored, "end_reason", *_POSE)
    agent = Recording(ActorAgent(actor), truth, states=True)
    episodes = rollout(
        agent,
        env,
        num_episodes,
        frames=num_frames,
        greedy=False,
        exact=True,
        keep=None,
    )
    batch: Any = episodes.steps
    info, after = batch["info"], batch["next", "info"]
    arrays = {
        "observations": batch[scenes.name],
        **{f"{_INPUT}{name}": batch[name] for name in scenes.others},
        **actions.kept(batch["action"]),
        "rewards": batch["next", "reward"][:, 0],
        **{name: info[name] for name in _POSE},
        **{f"{_STATE}{name}": value for name, value in batch["state"].items()},
        "episode": torch.arange(len(episodes)).repeat_interleave(episodes.length),
        "step": torch.cat([torch.arange(length) for length in episodes.length.tolist()]),
        "end_reason": after["end_reason"][:, 0],
    }
    if (memory := memory_in(dict(batch.items()))) is not None:
        arrays["memory"] = memory
    dataset = RolloutDataset({name: value.cpu().numpy() for name, value in arrays.items()})
    if task.edits is not None:
        dataset.arrays["next_target"] = task.edits.next_target(dataset.state(worlds)).cpu().numpy()
    before, now = (
        task.score({name: of[name].cpu() for name in task.scored}) for of in (info, after)
    )
    dataset.arrays["event"] = _events(dataset, task, before, now).to(torch.int8).numpy()
    return dataset


def _events(dataset: RolloutDataset, task: Task[Any], before: Goals, after: Goals) -> Tensor:
    """Return 1 where an action reaches a goal, -1 where it misses one, else 0. Shape: (T,).

    `before` and `after` are the goals before and after each step.
    """
    ends, is_last = dataset.tensor("end_reason"), torch.ones(len(dataset), dtype=torch.bool)
    is_last[:-1] = dataset.tensor("episode").diff() != 0
    has_next = torch.ones_like(is_last)
    if "next_target" in dataset.arrays:
        has_next = dataset.tensor("next_target") < len(task.make_props())
    has_next_after = torch.where(is_last, ends != task.expected_end, has_next.roll(-1))
    is_missed = _num_missed(after, has_next_after) > _num_missed(before, has_next)
    is_reached = after.reached.sum(-1) > before.reached.sum(-1)
    return torch.where(is_reached | (ends == task.success_end), 1, -is_missed.long())


def _num_missed(goals: Goals, has_next: Tensor) -> Tensor:
    """Return how many goals came up, are not reached, and are not the next one. Shape: (T,)."""
    return ((goals.stratum >= 0) & ~goals.reached).sum(-1) - has_next.long()


def select_frames(episode: NDArray, num_frames: int) -> NDArray:
    """Return indices of about as many frames of each episode, evenly spaced in time.

    `episode` has the episode of each frame, from 0, in order. At most `num_frames` are selected;
    episodes that are shorter than their part are selected whole.
    """
    lengths = np.bincount(episode)
    quota = np.zeros_like(lengths)
    while (left := min(num_frames, len(episode)) - quota.sum()) > 0:
        short = np.flatnonzero(quota < lengths)[:left]
        more = max(1, left // len(short))
        quota[short] = np.minimum(lengths[short], quota[short] + more)
    return spread_frames(episode, quota)


def spread_frames(episode: NDArray, most: int | NDArray) -> NDArray:
    """Return indices of at most `most` frames of each episode, evenly spaced in time.

    `most` is one number, or one of each episode. Shape: (T,) to (N,).
    """
    _, firsts, lengths = np.unique(episode, return_index=True, return_counts=True)
    counts = np.minimum(lengths, most)
    parts = [
        first + ((np.arange(count) + 0.5) * length / max(count, 1)).astype(int)
        for first, length, count in zip(firsts, lengths, counts, strict=True)
    ]
    return np.concatenate([np.zeros(0, int), *parts])


def render_frames(
    flights: RolloutDataset,
    rows: NDArray,
    scenes: Scenes,
    network: ImageNetwork,
    layers: tuple[str, ...] = (),
) -> RolloutDataset:
    """Return steps (T,) with frames, ground truth, probabilities and outputs of layers."""
    arrays = {name: value[rows] for name, value in flights.arrays.items()}
    dataset = RolloutDataset(arrays)
    worlds = scenes.worlds
    state = dataset.state(worlds)
    observations = dataset.tensor("observations")
    arrays["frames"] = scenes.frames(state).cpu().numpy()
    arrays["regions"] = scenes.regions(state).cpu().numpy()
    arrays["depth"] = scenes.depth(state).cpu().numpy().astype(np.float16)
    arrays["probabilities"] = probabilities(network, observations, dataset.rest).cpu().numpy()
    for layer in layers:
        outputs = features(network, observations, layer, dataset.rest)
        arrays[f"features/{layer}"] = outputs.cpu().numpy()
    return dataset


def run_from(
    scenes: Scenes,
    network: ImageNetwork,
    state: State,
    goes_on: Callable[[Step], Tensor],
    appearance: Appearance | None = None,
    memory: Tensor | None = None,
) -> State:
    """Step all environments with the policy's most probable actions until none goes on.

    At the initial states, a policy that observes a stack of frames has seen only the first one, and
    a recurrent one has a `memory`, see `hooks`. For `goes_on` see `steps`. The appearance is the
    task's by default. Return the last states.
    """
    ends = state[torch.arange(len(state), device=state.end_reason.device)]
    agent = greedy_agent(network, None if memory is None else entries_of(memory))
    observer, starts = scenes.observer(appearance), memory is None
    for step in steps(agent, observer, state, starts=starts, goes_on=goes_on):
        ends[step.rows] = step.after
    return ends


def run_to_end(scenes: Scenes, network: ImageNetwork, state: State) -> State:
    """Step until the episode ends, no target is left, or the policy is in a loop.

    A policy that sees no more than one image is in a loop if it is back at its pose of two steps
    before. Such episodes end with the task's truncation. `end_reason` is 0 where no target was
    left.
    """
    task = scenes.task
    previous: Tensor | None = None
    remembers = scenes.memory or scenes.others or isinstance(network, RecurrentNetwork)
    is_new = torch.ones(len(state), dtype=torch.bool, device=state.body.position.device)

    def goes_on(step: Step) -> Tensor:
        nonlocal previous, is_new
        after = step.after
        if previous is not None and not remembers:
            is_back = ((_pose(after) - previous).abs() < _SAME).all(-1)
            after.end_reason[is_back & ~is_new] = task.truncation
        active = (after.end_reason == 0) & ~task.edits.next_offset(after)[:, 0].isnan()
        is_new = (step.reward != 0)[active]  # with one target less, the scene is a new one
        previous = _pose(step.context.state)[active]
        return active

    return run_from(scenes, network, state, goes_on)


def _pose(state: State) -> Tensor:
    """Return positions and attitudes. Shape: (n, 7)."""
    return torch.cat([state.body.position, state.body.attitude], -1)
