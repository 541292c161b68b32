"""Rollouts of a policy with all that the simulator knows about them, in one file of plain arrays.

The file is an ordinary compressed `.npz`: `numpy.load(file)` gives the arrays, and the entry
"meta", a JSON text, describes them under "fields", so that no program of ours is needed to read it.
"""

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.explanations.scenes import Region
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
