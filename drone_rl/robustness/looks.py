"""Other colours and other light than a policy was trained in."""

import dataclasses
import math
from collections.abc import Callable

import torch
from torch import Tensor

from drone_rl.sim.rendering import Appearance, Scene
from drone_rl.sim.rendering.appearance import Several
from drone_rl.sim.rendering.scene import Meaning


def look_of(scene: Scene) -> Appearance:
    """How a scene looks, with all of it given but for distractors, which are told one by one."""
    known = [m for m in scene.meanings if m is not Meaning.DISTRACTOR]
    colors = {m: tuple(scene.colors[scene.geoms(m)[0], :3].tolist()) for m in known}
    model = scene.model
    lights = (model.light_ambient[0], model.light_diffuse[0], model.light_dir[0])
    ambient, sun, direction = (tuple(light.tolist()) for light in lights)
    return Appearance(
        colors={**colors, Meaning.SKY: scene.sky},
        ambient=ambient,
        sun=sun,
        sun_direction=direction,
    )


@dataclasses.dataclass(frozen=True)
class Tinted:
    """Things whose red, green and blue differ, each world in its own way."""

    meanings: tuple[Meaning, ...]
    """Of what; the others and what is not there stay as they are."""
    by: float
    """At most, of colours from 0 to 1."""
    dimensions: int = 3

    def __call__(self, appearance: Appearance, sway: Tensor) -> Appearance:
        """See `Look`."""
        return _painted(
            appearance, self.meanings, lambda own: (own.to(sway) + self.by * sway).clamp(0, 1)
        )


@dataclasses.dataclass(frozen=True)
class Whitened:
    """Things with white mixed into their colour."""

    meanings: tuple[Meaning, ...]
    share: float
    """Of white: 1 leaves nothing of the colour."""
    dimensions: int = 0

    def __call__(self, appearance: Appearance, sway: Tensor) -> Appearance:
        """See `Look`."""
        return _painted(appearance, self.meanings, lambda own: own + self.share * (1.0 - own))


@dataclasses.dataclass(frozen=True)
class SunAt:
    """The sun at another height, from where it was otherwise."""

    elevation: float
    """Degrees above the horizon."""
    dimensions: int = 0

    def __call__(self, appearance: Appearance, sway: Tensor) -> Appearance:
        """See `Look`."""
        assert appearance.sun_direction is not None
        ahead = _tensor(appearance.sun_direction)[..., :2]
        ahead = ahead / ahead.norm(dim=-1, keepdim=True)
        angle = math.radians(self.elevation)
        down = torch.full_like(ahead[..., :1], -math.sin(angle))
        direction = torch.cat([math.cos(angle) * ahead, down], -1)
        return dataclasses.replace(appearance, sun_direction=direction)


@dataclasses.dataclass(frozen=True)
class Exposed:
    """More light or less: the camera's exposure."""

    gain: float
    """How many times as much; what is brighter than white is white."""
    dimensions: int = 0

    def __call__(self, appearance: Appearance, sway: Tensor) -> Appearance:
        """See `Look`."""
        own = 1.0 if appearance.exposure is None else appearance.exposure
        return dataclasses.replace(appearance, exposure=self.gain * own)


@dataclasses.dataclass(frozen=True)
class Fogged:
    """Fog."""

    visibility: float
    """Metres, see `Appearance.fog`."""
    dimensions: int = 0

    def __call__(self, appearance: Appearance, sway: Tensor) -> Appearance:
        """See `Look`."""
        return dataclasses.replace(appearance, fog=self.visibility)


def elevation(direction: Several) -> float:
    """Height of a sun whose light goes there, degrees above the horizon."""
    x, y, z = _tensor(direction).tolist()
    return math.degrees(math.atan2(-z, math.hypot(x, y)))


def _painted(
    appearance: Appearance, meanings: tuple[Meaning, ...], paint: Callable[[Tensor], Tensor]
) -> Appearance:
    there = {m: paint(_tensor(c)) for m, c in appearance.colors.items() if m in meanings}
    return dataclasses.replace(appearance, colors={**appearance.colors, **there})


def _tensor(value: Several) -> Tensor:
    return torch.as_tensor(value, dtype=torch.float64)
