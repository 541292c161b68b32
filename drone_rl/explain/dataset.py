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
from torch import Tensor

from drone_rl.explain.scenes import Region
from drone_rl.sim.actions import Move
from drone_rl.sim.dynamics import BodyState
from drone_rl.sim.tasks.collect_cubes.rules import EndReason, WorldState
from drone_rl.utils.archives import read_arrays
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import parse_json

FLOWN = {
    "actions": "action taken: " + ", ".join(f"{a.value} {a.name.lower()}" for a in Move),
    "rewards": "reward of the action, float32 (T,)",
    "drone": "position before the action, metres, world frame: x forward, y left, z up (T, 3)",
    "cubes": "positions of the cubes, metres, in order of x (T, C, 3)",
    "present": "whether each cube still stands, bool (T, C)",
    "collected": "whether each cube has been collected, bool (T, C)",
    "next_cube": "index of the nearest standing cube, C if none (T,)",
    "episode": "number of the episode (T,)",
    "step": "step of the episode (T,)",
    "end_reason": "after the action: "
    + ", ".join(f"{r.value} {r.name.lower()}" for r in EndReason),
}
"""What is known of each frame; in the file also of every step flown, as "flights/..."."""
SEEN = {
    "observations": "what the policy's network got, float32 (T, C, h, w)",
    "probabilities": "the policy's probability of each action, float32 (T, 3)",
    "frames": "RGB pictures before the action, uint8 (T, H, W, 3)",
    "regions": "what each pixel shows: " + ", ".join(f"{r.value} {r.name.lower()}" for r in Region),
    "depth": "metres along the optical axis, 0 for the sky, float16 (T, H, W)",
}
"""What is known besides of those frames that are analysed."""
FIELDS = {**FLOWN, **SEEN}


@dataclasses.dataclass
class RolloutDataset:
    """Frames of flights, in order of time; see `FIELDS`. Flights that are not drawn lack some."""

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
        if name in FIELDS and name in self.arrays:
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
            body=BodyState.at_rest(self.tensor("drone").double()),
            cubes=self.tensor("cubes").double(),
            collected=collected,
            passed=~present & ~collected,
            side=torch.full(present.shape, -1),
            lateral=torch.full(present.shape, torch.nan, dtype=torch.float64),
            steps=self.tensor("step").clone(),
            end_reason=torch.zeros(len(self), dtype=torch.int64),
        )

    def save(self, path: str | Path, flights: "RolloutDataset | None" = None) -> None:
        """Writes the file.

        Args:
            path: Where to.
            flights: The whole episodes that the frames are from.

        Raises:
            InputError: It can't be written.
        """
        described = {**self.meta, "fields": FIELDS, "features": list(self.features)}
        more = {f"features/{name}": value for name, value in self.features.items()}
        if flights is not None:
            more |= {f"flights/{name}": flights.arrays[name] for name in FLOWN}
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
            arrays = {name: entries.pop(name) for name in FIELDS}
            layers = {k: v for k, v in entries.items() if k.startswith("features/")}
            if len({value.shape[:1] for value in arrays.values()}) > 1:
                raise InputError("its arrays are not of one length")
        except (InputError, KeyError) as error:
            raise InputError(
                f"data set {path} can't be read ({error}); record it again with drone-rl explain"
            ) from None
        return cls(arrays, {k.removeprefix("features/"): v for k, v in layers.items()}, meta)
