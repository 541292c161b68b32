"""Rollouts of a policy with all that the simulator knows about them, in one file of plain arrays.

The file is an ordinary compressed `.npz`: `numpy.load(file)` gives the arrays, and the entry
"meta", a JSON text, describes them under "fields", so that no program of ours is needed to read it.
"""

import dataclasses
import json
from collections.abc import Mapping
from pathlib import Path
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
from drone_rl.explanations.hooks import features, outputs, probabilities
from drone_rl.explanations.scenes import Region, Scenes
from drone_rl.policies import PictureNetwork
from drone_rl.sim.actions import Actions
from drone_rl.sim.dynamics import BodyState, Dynamics
from drone_rl.sim.tasks import State, Task
from drone_rl.utils.archives import read_arrays
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import parse_json
from drone_rl.utils.limits import check_indices
from drone_rl.utils.schema import as_mapping

MOST_STEPS = 10**7
"""Numbers of steps or episodes in a data set: arrays are counted by them."""
SEEN = {
    "observations": "what the policy's network got, float32 (T, C, h, w)",
    "probabilities": "the policy's probability of each action, float32 (T, number of actions)",
    "frames": "RGB pictures before the action, uint8 (T, H, W, 3)",
    "regions": "what each pixel shows: " + ", ".join(f"{r.value} {r.name.lower()}" for r in Region),
    "depth": "metres along the optical axis, 0 for the sky, float16 (T, H, W)",
}
"""What is known besides of those frames that are analysed."""


def flown_fields(task: Task[Any], actions: Actions) -> dict[str, str]:
    """What is known of each frame; in the file also of every step flown, as "flights/..."."""
    ends = ", ".join(f"{end.value} {end.name.lower()}" for end in task.ends)
    return {
        **actions.fields(),
        "rewards": "reward of the action, float32 (T,)",
        "event": "1 where the action reaches a goal, -1 where it misses one, else 0, int8 (T,)",
        "drone": "position before the action, metres, world frame: x forward, y left, z up (T, 3)",
        "attitude": "of the drone before the action, quaternion (w, x, y, z) (T, 4)",
        **task.remembered,
        "episode": "number of the episode (T,)",
        "step": "step of the episode (T,)",
        "end_reason": "after the action: " + ends,
    }


@dataclasses.dataclass
class RolloutDataset:
    """Frames of flights, in order of time; see `flown_fields` and `SEEN`.

    Flights that are not drawn lack most of what is seen.
    """

    arrays: dict[str, NDArray]
    features: dict[str, NDArray]
    """What each recorded layer made of the frames, by layer name. Shape: (T, *)."""
    meta: dict[str, Any]
    """Where it comes from; its "fields" describe the arrays."""

    def __len__(self) -> int:
        """Returns the number of frames."""
        return len(self.arrays["actions"])

    def __getattr__(self, name: str) -> NDArray:
        """Returns an array by name."""
        if name in (arrays := vars(self).get("arrays", {})):
            return arrays[name]
        raise AttributeError(name)

    def tensor(self, name: str) -> Tensor:
        """An array as a tensor."""
        return torch.from_numpy(self.arrays[name])

    def offset(self, task: Task[Any]) -> NDArray:
        """The next target's place seen from the drone: metres ahead and to the left.

        Returns:
            Shape: (T, 2); NaN where no target is left.
        """
        return task.next_offset(self.state(task))[:, :2].numpy()

    def state(self, task: Task[Any], dynamics: Dynamics | None = None) -> State:
        """The worlds as they stood, the drones at rest, ready to be changed and drawn again.

        Args:
            task: What was flown.
            dynamics: By which it goes on; drones that have more than a pose, such as rotors, have
                it then as at the start of an episode. None if it doesn't.
        """
        kept = {name: self.tensor(name) for name in (*task.remembered, "step")}
        attitude = self.tensor("attitude").double() if "attitude" in self.arrays else None
        place = self.tensor("drone").double()
        body = BodyState.at_rest(place, attitude)
        begun = body if dynamics is None else dynamics.start(place)
        if type(begun) is not BodyState:
            body = begun.moved(place, attitude)
        return task.recall(kept, body)

    def save(self, path: str | Path, flights: "RolloutDataset | None" = None) -> None:
        """Writes the file.

        Args:
            path: Where to.
            flights: The whole episodes that the frames are from.

        Raises:
            InputError: It can't be written.
        """
        described = {**self.meta, "features": list(self.features)}
        more = {f"features/{name}": value for name, value in self.features.items()}
        if flights is not None:
            whole = flights.arrays.items()
            more |= {f"flights/{name}": value for name, value in whole if name not in SEEN}
        try:
            arrays: dict[str, Any] = {**self.arrays, **more}  # or numpy's allow_pickle is in doubt
            np.savez_compressed(path, meta=json.dumps(described), **arrays)
        except OSError as error:
            raise InputError(
                f"data set {path} can't be written ({error.strerror}); choose another folder"
            ) from error

    @classmethod
    def load(cls, path: str | Path) -> "RolloutDataset":
        """Reads the file.

        Raises:
            InputError: It is missing, damaged or something else.
        """
        try:
            entries = read_arrays(Path(path))
            meta = parse_json(str(entries.pop("meta")), f"{path}: meta")
            names = as_mapping(as_mapping(meta, "meta").get("fields"), "meta.fields")
            arrays = {name: entries.pop(name) for name in names}
            layers = {k: v for k, v in entries.items() if k.startswith("features/")}
            for name in ("episode", "step"):
                if name in arrays:
                    check_indices(arrays[name], MOST_STEPS, name)
            if len({value.shape[:1] for value in arrays.values()}) > 1:
                raise InputError("its arrays are not of one length")
        except (InputError, KeyError) as error:
            raise InputError(
                f"data set {path} can't be read ({error}); record it again with drone-rl explain"
            ) from None
        return cls(arrays, {k.removeprefix("features/"): v for k, v in layers.items()}, meta)


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
    """Collect episodes and render some frames; see `collect`, `select_frames`, `render_frames`.

    Raises:
        InputError: No frames are asked for, or a layer doesn't exist.
    """
    flights = collect(
        env, actor, num_episodes=num_episodes, num_frames=num_frames, greedy=greedy, meta=meta
    )
    return render_frames(
        flights, select_frames(flights.episode, num_frames), Scenes(env), network, layers
    )


def collect(
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


def select_frames(episode: NDArray, num_frames: int) -> NDArray:
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


def render_frames(
    flights: RolloutDataset,
    rows: NDArray,
    scenes: Scenes,
    network: PictureNetwork,
    layers: tuple[str, ...] = (),
) -> RolloutDataset:
    """Some frames of flights, with all that can be known about them.

    Args:
        flights: From `collect`.
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


_SAME = 1e-9
"""Metres, and parts of a quaternion: those of a move there and back differ by rounding."""


@torch.no_grad()
def fly_on(scenes: Scenes, network: PictureNetwork, state: State) -> State:
    """Flies until it is settled which targets are reached.

    That is when the flight ends, when no target is left, or when a policy that remembers nothing
    is back where it was two steps before: it would go back and forth, or stay, to the step limit.

    Args:
        scenes: Where the flights are drawn.
        network: The policy's.
        state: Where they start; a policy that sees several frames has seen this one only.

    Returns:
        How they ended; `end_reason` is 0 where no target was left. Shape: that of `state`.
    """
    task, actions, device = scenes.task, scenes.actions, state.body.position.device
    flying = torch.arange(len(state), device=device)
    done, now, earlier = state[flying], state, []
    before: Tensor | None = None
    is_new = torch.ones_like(flying, dtype=torch.bool)
    while len(flying):
        frames = scenes.frames(now)
        action = actions.greedy(outputs(network, scenes.transform(frames, earlier))).to(device)
        here = _pose(now)
        now, reward = scenes.worlds.advance(now, action)
        if before is not None and not scenes.memory:
            is_back = ((_pose(now) - before).abs() < _SAME).all(-1)
            now.end_reason[is_back & ~is_new] = task.truncation
        done[flying] = now
        on = (now.end_reason == 0) & ~task.next_offset(now)[:, 0].isnan()
        earlier = [*earlier, frames][-scenes.memory :] if scenes.memory else []
        earlier = [pictures[on] for pictures in earlier]
        is_new = (reward != 0)[on]  # a target less is another scene
        now, flying, before = now[on], flying[on], here[on]
    return done


def _pose(state: State) -> Tensor:
    """Where drones are and how they are turned. Shape: (n, 7)."""
    return torch.cat([state.body.position, state.body.attitude], -1)
