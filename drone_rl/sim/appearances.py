"""How each of many worlds looks: drawn when its episode begins, from its own random stream."""

import copy
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor

from drone_rl.sim.meaning import Meaning
from drone_rl.sim.rendering import Appearance, Texture, textures
from drone_rl.sim.settings import AppearanceSettings
from drone_rl.sim.settings.appearance import NO_TEXTURE, Names

_OBJECTS = (Meaning.TARGET, Meaning.OBSTACLE)
_APART = 7919
"""Keeps the draws of an appearance apart from those of the task."""


class Appearances:
    """Draws them, and says what worlds look like."""

    def __init__(self, settings: AppearanceSettings, num_worlds: int, device: str = "cpu") -> None:
        """Reads all textures; every world looks as in the middle of all ranges at first.

        Args:
            settings: What is drawn from.
            num_worlds: How many.
            device: Where they are drawn.

        Raises:
            InputError: A texture can't be read, or is too large.
        """
        self._settings, self._device = settings, device
        for name in {*(settings.ground_texture or ()), *(settings.object_texture or ())}:
            if name != NO_TEXTURE:
                textures.load(name)
        middle = _draw(settings, None)
        self.varies = _draw(settings, np.random.RandomState(0)) != middle
        """Whether worlds look otherwise from episode to episode."""
        self.middle = (
            None if settings.is_minimal else self._made(torch.tensor(middle, dtype=torch.float64))
        )
        """The look of worlds that were only imagined; none for that of the task."""
        self.values = torch.tensor([middle], dtype=torch.float64).repeat(num_worlds, 1)
        """What was drawn, a row a world."""
        self._now: Appearance | None = None

    def reset(self, worlds: Tensor, random_states: Sequence[np.random.RandomState]) -> None:
        """Draws anew.

        Args:
            worlds: Indices of the worlds. Shape: (k,).
            random_states: Theirs, as they are before the task draws: they stay so, and episodes are
                the same whatever they look like.
        """
        if not self.varies or not len(worlds):
            return
        rows = [_draw(self._settings, _beside(state)) for state in random_states]
        self.values = self.values.clone()
        self.values[worlds.cpu()] = torch.tensor(rows, dtype=torch.float64)
        self._now = None

    def load(self, values: Tensor) -> None:
        """Goes on with the `values` of another time."""
        self.values, self._now = values.clone(), None

    def drawn(self, worlds: Tensor | None = None) -> Appearance | None:
        """What was drawn for worlds; none where nothing is, for all look as in the middle.

        Args:
            worlds: Indices, in order; all by default. Shape: (k,).
        """
        if not self.varies:
            return None
        if worlds is not None and len(worlds) < len(self.values):
            return self._made(self.values[worlds.cpu()])
        if self._now is None:
            self._now = self._made(self.values)
        return self._now

    def _made(self, values: Tensor) -> Appearance:
        """Of rows as `_draw` makes them, or of a single one. Shape: (num_worlds, *) or (*)."""
        settings, values = self._settings, values.to(self._device)
        columns = iter(values.unbind(-1))

        def number() -> Tensor:
            return next(columns)

        def color() -> Tensor:
            return torch.stack([number(), number(), number()], -1)

        up, around = torch.deg2rad(number()), torch.deg2rad(number())
        sun = number()[..., None] * color()
        ambient = number()[..., None].expand(sun.shape)
        shadows, horizon = number(), color()
        zenith, fog = color(), number()
        ground, objects, exposure = color(), color(), number()
        colors = {Meaning.SKY: horizon, Meaning.GROUND: ground}
        if settings.object_color is not None:
            colors |= dict.fromkeys(_OBJECTS, objects)
        covers = {
            Meaning.GROUND: _cover(settings.ground_texture, number(), number()),
            **dict.fromkeys(_OBJECTS, _cover(settings.object_texture, number(), number())),
        }
        level = -torch.cos(up)
        direction = [level * torch.cos(around), level * torch.sin(around), -torch.sin(up)]
        return Appearance(
            colors=colors,
            ambient=ambient,
            sun=sun,
            sun_direction=torch.stack(direction, -1),
            zenith=None if settings.sky_zenith is None else zenith,
            fog=None if settings.fog_visibility is None else fog,
            shadows=shadows if settings.shadows else None,
            exposure=None if settings.exposure == 1.0 else exposure,
            textures={meaning: cover for meaning, cover in covers.items() if cover is not None},
        )


def _draw(settings: AppearanceSettings, source: np.random.RandomState | None) -> list[float]:
    """One number after the other, in the order in which they are read; middles without a source."""

    def number(value: Any) -> float:
        if not isinstance(value, tuple):
            return value
        return sum(value) / 2 if source is None else source.uniform(*value)

    def color(value: Any) -> list[float]:
        if not isinstance(value[0], tuple):
            return list(value)
        return [number(pair) for pair in zip(*value, strict=True)]

    def texture(names: Names | None) -> int:
        if not names:
            return -1
        chosen = 0 if source is None else source.randint(len(names))
        known = [name for name in names if name != NO_TEXTURE]
        return -1 if names[chosen] == NO_TEXTURE else known.index(names[chosen])

    s, fog = settings, settings.fog_visibility
    share = 0.5 if source is None or s.shadows in (0.0, 1.0) else source.uniform()
    drawn = [number(s.sun_elevation), number(s.sun_azimuth), number(s.sun_strength)]
    drawn += [*color(s.sun_color), number(s.ambient_strength), float(share <= s.shadows)]
    drawn += [*color(s.sky_horizon), *color(s.sky_zenith or s.sky_horizon)]
    drawn += [math.inf if fog is None else number(fog), *color(s.ground_color)]
    drawn += [*color(s.object_color or (0.0, 0.0, 0.0)), number(s.exposure)]
    drawn += [texture(s.ground_texture), number(s.ground_tile)]
    return [*drawn, texture(s.object_texture), number(s.object_tile)]


def _beside(random_state: np.random.RandomState) -> np.random.RandomState:
    """A stream that depends on where another is, which stays there."""
    ahead = copy.deepcopy(random_state)
    return np.random.RandomState([_APART, *ahead.randint(0, 2**32, 4, dtype=np.uint32)])


def _cover(names: Names | None, choice: Tensor, tile: Tensor) -> Texture | None:
    known = tuple(name for name in names or () if name != NO_TEXTURE)
    return Texture(pictures=known, size=tile, choice=choice) if known else None
