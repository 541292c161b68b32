"""Rollouts of a policy with all that the simulator knows about them, in one file of plain arrays.

The file is an ordinary compressed `.npz`: `numpy.load(file)` gives the arrays that `FIELDS`
describes, and the entry "meta", a JSON text, describes them once more, so that no program of ours
is needed to read it.
"""

import dataclasses
import json
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
from drone_rl.explain.hooks import features, probabilities
from drone_rl.explain.scenes import Region, Scenes
from drone_rl.policies import PolicyNetwork
from drone_rl.sim.rules import Action, EndReason, WorldState
from drone_rl.utils.errors import InputError

FIELDS = {
    "frames": "RGB pictures before the action, uint8 (T, H, W, 3)",
    "observations": "what the policy's network got, float32 (T, C, h, w)",
    "actions": "action taken: " + ", ".join(f"{a.value} {a.name.lower()}" for a in Action),
    "probabilities": "the policy's probability of each action, float32 (T, 3)",
    "rewards": "reward of the action, float32 (T,)",
    "drone": "position before the action, metres, world frame: x forward, y left, z up (T, 3)",
    "cubes": "positions of the cubes, metres, in order of x (T, C, 3)",
    "present": "whether each cube still stands, bool (T, C)",
    "collected": "whether each cube has been collected, bool (T, C)",
    "next_cube": "index of the nearest standing cube, C if none (T,)",
    "regions": "what each pixel shows: " + ", ".join(f"{r.value} {r.name.lower()}" for r in Region),
    "depth": "metres along the optical axis, 0 for the sky, float16 (T, H, W)",
    "episode": "number of the episode (T,)",
    "step": "step of the episode (T,)",
    "end_reason": "after the action: "
    + ", ".join(f"{r.value} {r.name.lower()}" for r in EndReason),
}
_TRUTH = ("drone", "cube_positions", "collected", "next_cube")


@dataclasses.dataclass
class RolloutDataset:
    """Consecutive frames of whole episodes, the last of which may be cut; see `FIELDS`."""

    arrays: dict[str, NDArray]
    features: dict[str, NDArray]
    """What each recorded layer made of the frames, by layer name. Shape: (T, *)."""
    meta: dict[str, Any]
    """Where it comes from."""

    def __len__(self) -> int:
        """Returns the number of frames."""
        return len(self.arrays["actions"])

    def __getattr__(self, name: str) -> NDArray:
        """Returns an array by name."""
        if name in FIELDS:
            return self.arrays[name]
        raise AttributeError(name)

    def tensor(self, name: str) -> Tensor:
        """An array as a tensor."""
        return torch.from_numpy(self.arrays[name])

    def offset(self) -> NDArray:
        """The next cube's place seen from the drone: metres ahead and to the left.

        Returns:
            Shape: (T, 2); NaN where no cube is left.
        """
        index = np.minimum(self.next_cube, self.cubes.shape[1] - 1)
        cube = self.cubes[np.arange(len(self)), index]
        away = (cube - self.drone)[:, :2].astype(np.float64)
        away[self.next_cube >= self.cubes.shape[1]] = np.nan
        return away

    def state(self) -> WorldState:
        """The worlds as they stood, ready to be changed and drawn again."""
        present, collected = self.tensor("present"), self.tensor("collected")
        return WorldState(
            drone=self.tensor("drone").double(),
            cubes=self.tensor("cubes").double(),
            collected=collected,
            passed=~present & ~collected,
            side=torch.full(present.shape, -1),
            lateral=torch.full(present.shape, torch.nan, dtype=torch.float64),
            steps=self.tensor("step").clone(),
            end_reason=torch.zeros(len(self), dtype=torch.int64),
        )

    def save(self, path: str | Path) -> None:
        """Writes the file.

        Raises:
            InputError: It can't be written.
        """
        described = {**self.meta, "fields": FIELDS, "features": list(self.features)}
        layers = {f"features/{name}": value for name, value in self.features.items()}
        try:
            np.savez_compressed(path, meta=json.dumps(described), **self.arrays, **layers)
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
            with np.load(path, allow_pickle=False) as file:
                entries = {name: file[name] for name in file.files}
            meta = json.loads(str(entries.pop("meta")))
            arrays = {name: entries.pop(name) for name in FIELDS}
        except (OSError, ValueError, KeyError, EOFError) as error:
            raise InputError(
                f"data set {path} can't be read ({error}); record it again with drone-rl explain"
            ) from error
        return cls(arrays, {k.removeprefix("features/"): v for k, v in entries.items()}, meta)


class _WithTruth(TensorDictModuleBase):
    """An actor that also lets the simulator's truth through, so that it is recorded."""

    def __init__(self, actor: TensorDictModuleBase) -> None:
        super().__init__()
        self.actor = actor
        self.in_keys = [*actor.in_keys, *(("info", name) for name in _TRUTH)]
        self.out_keys = actor.out_keys

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Acts."""
        return self.actor(tensordict)


def record(
    env: TransformedEnv,
    actor: TensorDictModuleBase,
    network: PolicyNetwork,
    num_frames: int,
    *,
    layers: tuple[str, ...] = (),
    greedy: bool = False,
    meta: dict[str, Any] | None = None,
) -> RolloutDataset:
    """Flies a policy and records what it saw, did, and what was there in truth.

    Args:
        env: A batch of worlds.
        actor: The policy.
        network: Its network.
        num_frames: How many frames; episodes follow one another, and the last one is cut.
        layers: Layers whose output is recorded.
        greedy: Whether to take the most probable action instead of drawing one.
        meta: Where the policy comes from.

    Raises:
        InputError: No frames are asked for, or a layer doesn't exist.
    """
    if num_frames < 1:
        raise InputError(f"frames={num_frames} records nothing; give 1 or more")
    batch = _collect(env, _WithTruth(actor), num_frames, greedy)
    arrays = _arrays(batch)
    dataset = RolloutDataset(arrays, {}, {"greedy": greedy, **(meta or {})})
    scenes, state = Scenes(env), dataset.state().to(env.device)
    observations = batch["pixels"]
    arrays["frames"] = scenes.frames(state).cpu().numpy()
    arrays["regions"] = scenes.regions(state).cpu().numpy()
    arrays["depth"] = scenes.depth(state).cpu().numpy().astype(np.float16)
    arrays["observations"] = observations.cpu().numpy()
    arrays["probabilities"] = probabilities(network, observations).cpu().numpy()
    for layer in layers:
        dataset.features[layer] = features(network, observations, layer).cpu().numpy()
    return dataset


def _collect(
    env: TransformedEnv, actor: TensorDictModuleBase, num_frames: int, greedy: bool
) -> TensorDictBase:
    keep = (("next", "info", "end_reason"),)
    collector = EpisodeCollector(env, actor, keep=keep)
    kind = ExplorationType.DETERMINISTIC if greedy else ExplorationType.RANDOM
    batches = []
    with set_exploration_type(kind):
        while sum(len(b) for b in batches) < num_frames:
            batches.append(collector.collect())
    return torch.cat(batches)[:num_frames]


def _arrays(batch: TensorDictBase) -> dict[str, NDArray]:
    info: TensorDict = batch["info"]
    episode = batch["collector", "traj_ids"]
    starts = torch.cat([episode.new_ones(1, dtype=torch.bool), episode[1:] != episode[:-1]])
    first = starts.nonzero()[:, 0][starts.cumsum(0) - 1]
    next_cube = info["next_cube"][:, 0]
    index = torch.arange(info["collected"].shape[-1], device=next_cube.device)
    # cubes stand in order of x, so a standing cube is the next one or one behind it
    present = ~info["collected"] & (index >= next_cube[:, None])
    arrays = {
        "actions": batch["action"],
        "rewards": batch["next", "reward"][:, 0],
        "drone": info["drone"],
        "cubes": info["cube_positions"],
        "present": present,
        "collected": info["collected"],
        "next_cube": next_cube,
        "episode": starts.cumsum(0) - 1,
        "step": torch.arange(len(batch), device=episode.device) - first,
        "end_reason": batch["next", "info", "end_reason"][:, 0],
    }
    return {name: value.cpu().numpy() for name, value in arrays.items()}
