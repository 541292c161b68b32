"""How things look: colours and light, which may differ from world to world within one call."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import torch
from torch import Tensor

from drone_rl.sim.meaning import Meaning

Color = tuple[float, float, float]
"""Red, green, blue, from 0 to 1."""
Several = Color | Tensor
"""One for all worlds, or one for each: shape (num_worlds, 3)."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Appearance:
    """What looks otherwise than in the model; what is not given stays as it is there."""

    colors: Mapping[Meaning, Several] = dataclasses.field(default_factory=dict)
    """Of all things with a meaning, the sky's among them."""
    ambient: Several | None = None
    """Light from everywhere."""
    sun: Several | None = None
    """Light of the sun."""
    sun_direction: Several | None = None
    """Where its light goes, world frame; need not be of length 1."""

    def lights(self, num_worlds: int) -> dict[str, Tensor]:
        """Those that are given, of each world, by name; directions have length 1.

        Args:
            num_worlds: As many as it has.

        Returns:
            Shapes: (num_worlds, 3), float64.
        """
        names = ("ambient", "sun", "sun_direction")
        given = {name: getattr(self, name) for name in names}
        lights = {name: each(v, num_worlds) for name, v in given.items() if v is not None}
        if "sun_direction" in lights:
            direction = lights["sun_direction"]
            lights["sun_direction"] = direction / direction.norm(dim=-1, keepdim=True)
        return lights

    def __getitem__(self, worlds: slice) -> "Appearance":
        """Returns that of some worlds."""
        cut = {f.name: _cut(getattr(self, f.name), worlds) for f in dataclasses.fields(self)}
        return Appearance(**cut)


def each(value: Several, num_worlds: int) -> Tensor:
    """One value for each world. Shape: (num_worlds, 3), float64."""
    return torch.as_tensor(value, dtype=torch.float64).expand(num_worlds, 3)


def _cut(value: Any, worlds: slice) -> Any:
    if isinstance(value, Mapping):
        return {meaning: _cut(color, worlds) for meaning, color in value.items()}
    return value[worlds] if isinstance(value, Tensor) and value.dim() > 1 else value
