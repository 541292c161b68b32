"""Visual randomization: sample the appearance of each environment when its episode begins.

Each environment samples from a stream of its own: episodes are the same for any appearance.
"""

import copy
import dataclasses
import functools
import itertools
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor

from drone_rl.config import AppearanceSettings, BaseTaskSettings, CameraSettings
from drone_rl.config.appearance import (
    MINIMAL,
    NO_TEXTURE,
    Names,
    ObjectAppearance,
    check_appearance,
    low_and_high,
)
from drone_rl.config.task import ObjectRegion
from drone_rl.sim.rendering import Appearance, Distractors, Mounting, Texture, textures
from drone_rl.sim.rendering.appearance import Lamp, ObjectLook, product, turned, zoom_for_fov
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.tasks import Task, as_task
from drone_rl.sim.tasks.common import HIDDEN_DEPTH

PALETTE = (
    (0.93, 0.71, 0.22),
    (0.20, 0.55, 0.62),
    (0.87, 0.87, 0.83),
    (0.36, 0.62, 0.36),
    (0.29, 0.40, 0.66),
    (0.58, 0.47, 0.66),
)
"""Yellow, teal, white, green, blue, violet: neither the red of goals nor the brown of obstacles."""
WIDTH = 7
"""Numbers of a distractor: position, size, color."""
_TURN = (5**0.5 - 1) / 2
"""The step, as a fraction of the path, that leaves the most even gaps."""


def object_region_of(task: Any) -> ObjectRegion | None:
    """Return where the props of a task, or of its settings, stand; None if unknown."""
    settings = task if isinstance(task, BaseTaskSettings) else getattr(task, "settings", None)
    return getattr(settings, "object_region", None)


def most_distractors(settings: AppearanceSettings) -> int:
    """Return the largest number of distractors."""
    count = settings.distractors
    return count[1] if isinstance(count, tuple) else count


def stand(
    region: ObjectRegion, ahead: Tensor, aside: Tensor, is_left: Tensor, height: float | Tensor
) -> Tensor:
    """Return positions next to the path, metres, world frame. Shape: (*, 3), float64.

    `ahead` and `height` are coordinates, `aside` the distance from the region of the task's props.
    """
    side = (region.bound + aside) * (2.0 * is_left.double() - 1.0)
    return torch.stack([ahead, side, torch.as_tensor(height).expand(ahead.shape)], -1)


def draw_distractors(
    settings: AppearanceSettings, region: ObjectRegion | None, source: np.random.RandomState | None
) -> list[float]:
    """Sample `WIDTH` numbers of each distractor, left and right of the path of the task's props.

    Without a random stream, return the middles of all ranges.
    """
    most = most_distractors(settings)
    if not most or region is None:
        return []
    number = torch.arange(most)
    count = _uniform(settings.distractors, source, ())
    if isinstance(settings.distractors, tuple) and source is not None:
        count = source.randint(settings.distractors[0], most + 1)
    begin, shift = _uniform((0.0, 1.0), source, ()), _uniform((-0.5, 0.5), source, (most,))
    share = (begin + number // 2 * _TURN + number % 2 * 0.5 + shift / most) % 1.0
    size = _uniform(settings.distractor_size, source, (most,))
    away = _uniform(settings.distractor_distance, source, (most,)) + size / 2
    height = size / 2 - HIDDEN_DEPTH * (number >= count)
    ahead = share * (region.first + region.last)
    places = stand(region, ahead, away, number % 2 == 0, height)
    colors = torch.stack([_color(settings, source, i) for i in range(most)])
    return torch.cat([places, size[:, None], colors], -1).flatten().tolist()


def _uniform(value: Any, source: np.random.RandomState | None, shape: tuple[int, ...]) -> Tensor:
    low, high = value if isinstance(value, tuple) else (value, value)
    if low == high or source is None:
        return torch.full(shape, (low + high) / 2, dtype=torch.float64)
    return torch.as_tensor(source.uniform(low, high, shape), dtype=torch.float64)


def _color(
    settings: AppearanceSettings, source: np.random.RandomState | None, number: int
) -> Tensor:
    color_range = settings.distractor_color
    if color_range is None:
        turn = number + number // len(PALETTE)  # otherwise each shape would have only two colors
        return torch.tensor(PALETTE[turn % len(PALETTE)], dtype=torch.float64)
    return torch.stack([_uniform(pair, source, ()) for pair in low_and_high(color_range)])


_OBJECTS = (SemanticClass.TARGET, SemanticClass.OBSTACLE)
_APART = 7919
"""Separates the random stream of an appearance from that of the task."""
_STILL = _BLACK = (0.0, 0.0, 0.0)
_OF_CAMERA = 7
"""Numbers of a camera mounting."""


class AppearanceSampler:
    """Samples and keeps the appearance of each environment."""

    def __init__(
        self,
        settings: AppearanceSettings,
        num_envs: int,
        device: str = "cpu",
        *,
        task: BaseTaskSettings | Task[Any] | None = None,
        camera: CameraSettings | None = None,
    ) -> None:
        """Read all textures; environments start in the middle of all ranges.

        The device is the renderer's, the camera the policy's. Raises an `InputError` if a texture
        can't be read or is too large, or the camera or distractors do not fit into the scene.
        """
        task, self._camera = as_task(task), camera or CameraSettings()
        self._region = object_region_of(task)
        self._has_scene = bool(getattr(task, "scenes", ()))
        check_appearance(settings, self._camera, self._region, task.name, self._has_scene)
        self.settings, self._device = settings, device
        self.distractors = most_distractors(settings)
        """Largest number of distractors."""
        named = [one.texture for one in (settings.objects or {}).values()]
        for name in {
            n for of in (settings.ground_texture, settings.object_texture, *named) for n in of or ()
        }:
            if name != NO_TEXTURE:
                textures.load(name)
        middle = self._sample(None)
        self.varies = settings.varies
        """See `AppearanceSettings.varies`."""
        self.middle = (
            None
            if settings.is_minimal
            else self._to_appearance(torch.tensor(middle, dtype=torch.float64))
        )
        """Appearance in the middle of all ranges; None for the task's own."""
        self.values = torch.tensor([middle], dtype=torch.float64).repeat(num_envs, 1)
        """Sampled numbers. Shape: (num_envs, *)."""
        self._now: Appearance | None = None

    def reset(self, env_ids: Tensor, random_states: Sequence[np.random.RandomState]) -> None:
        """Sample new appearances by indices, (k,); the given random streams are not advanced."""
        if not self.varies or not len(env_ids):
            return
        rows = [self._sample(_appearance_stream(state)) for state in random_states]
        self.values = self.values.clone()
        self.values[env_ids.cpu()] = torch.tensor(rows, dtype=torch.float64)
        self._now = None

    def load(self, values: Tensor) -> None:
        """Restore saved `values`."""
        self.values, self._now = values.clone(), None

    def current(self, env_ids: Tensor | None = None) -> Appearance | None:
        """Return appearances by ordered indices, (k,), all by default; None if they never vary."""
        if not self.varies:
            return None
        if env_ids is not None and len(env_ids) < len(self.values):
            return self._to_appearance(self.values[env_ids.cpu()])
        if self._now is None:
            self._now = self._to_appearance(self.values)
        return self._now

    def _sample(self, source: np.random.RandomState | None) -> list[float]:
        # New numbers are sampled last, so that earlier ones keep their values.
        numbers = _sample_numbers(self.settings, source)
        return [*numbers, *draw_distractors(self.settings, self._region, source)]

    def _to_appearance(self, values: Tensor) -> Appearance:
        """Appearance of rows of `_sample`, or of one. Shape: (num_envs, *) or (*)."""
        settings, values = self.settings, values.to(self._device)
        columns = iter(values.unbind(-1))
        number = functools.partial(next, columns)

        def color() -> Tensor:
            return torch.stack([number(), number(), number()], -1)

        up, around = torch.deg2rad(number()), torch.deg2rad(number())
        sun = number()[..., None] * color()
        ambient = number()[..., None].expand(sun.shape)
        shadows, horizon = number(), color()
        zenith, visibility = color(), number()
        ground, objects, exposure = color(), color(), number()
        colors = {SemanticClass.SKY: horizon, SemanticClass.GROUND: ground}
        if settings.object_color is not None:
            colors |= dict.fromkeys(_OBJECTS, objects)
        covers = {
            SemanticClass.GROUND: _cover(settings.ground_texture, number(), number()),
            **dict.fromkeys(_OBJECTS, _cover(settings.object_texture, number(), number())),
        }
        mounting = self._mounting(torch.stack([number() for _ in range(_OF_CAMERA)], -1))
        level = -torch.cos(up)
        direction = [level * torch.cos(around), level * torch.sin(around), -torch.sin(up)]
        whole = Appearance(
            colors=colors,
            ambient=ambient,
            sun=sun,
            sun_direction=torch.stack(direction, -1),
            zenith=None if settings.sky_zenith is None else zenith,
            fog_visibility=None if settings.fog_visibility is None else visibility,
            shadows=shadows if settings.shadows else None,
            exposure=None if settings.exposure == 1.0 else exposure,
            textures={of: cover for of, cover in covers.items() if cover is not None},
            camera=mounting,
            objects={n: _object(one, color, number) for n, one in (settings.objects or {}).items()},
            lamps={n: Lamp(color=number()[..., None] * color()) for n in settings.lights or {}},
            distractors=self._distractors(list(columns)),
        )
        return _of_scene(whole, settings) if self._has_scene else whole

    def _mounting(self, values: Tensor) -> Mounting | None:
        s = self.settings
        is_moved = s.camera_offset != _STILL or s.camera_turn != _STILL
        if not is_moved and s.camera_widening == 0.0:
            return None
        roll, pitch, yaw = values[..., 3:6].unbind(-1)
        turn = product(turned("yaw", yaw), product(turned("pitch", pitch), turned("roll", roll)))
        fov = self._camera.horizontal_fov
        zoom = None if s.camera_widening == 0.0 else zoom_for_fov(fov, fov + values[..., 6])
        return Mounting(offset=values[..., :3], turn=turn, zoom=zoom)

    def _distractors(self, columns: list[Tensor]) -> Distractors | None:
        if not columns:
            return None
        rows = torch.stack(columns, -1).unflatten(-1, (self.distractors, WIDTH))
        return Distractors(places=rows[..., :3], sizes=rows[..., 3], colors=rows[..., 4:])


def _sample_numbers(
    settings: AppearanceSettings, source: np.random.RandomState | None
) -> list[float]:
    """Return numbers as `AppearanceSampler._to_appearance` reads them; middles without a source."""

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
        number = 0 if source is None else source.randint(len(names))
        images = [name for name in names if name != NO_TEXTURE]
        return -1 if names[number] == NO_TEXTURE else images.index(names[number])

    s, fog = settings, settings.fog_visibility
    share = 0.5 if source is None or s.shadows in (0.0, 1.0) else source.uniform()
    numbers = [number(s.sun_elevation), number(s.sun_azimuth), number(s.sun_strength)]
    numbers += [*color(s.sun_color), number(s.ambient_strength), float(share <= s.shadows)]
    numbers += [*color(s.sky_horizon), *color(s.sky_zenith or s.sky_horizon)]
    numbers += [math.inf if fog is None else number(fog), *color(s.ground_color)]
    numbers += [*color(s.object_color or _BLACK), number(s.exposure)]
    numbers += [texture(s.ground_texture), number(s.ground_tile)]
    numbers += [texture(s.object_texture), number(s.object_tile)]
    camera = (*low_and_high(s.camera_offset), *low_and_high(s.camera_turn), s.camera_widening)
    numbers += [float(_uniform(pair, source, ())) for pair in camera]
    objects = [
        [*color(one.color or _BLACK), texture(one.texture), number(one.tile)]
        for one in (s.objects or {}).values()
    ]
    lamps = [[number(lamp.strength), *color(lamp.color)] for lamp in (s.lights or {}).values()]
    return [*numbers, *itertools.chain(*objects, *lamps)]


def _appearance_stream(random_state: np.random.RandomState) -> np.random.RandomState:
    """Return a stream seeded by another one, which is not advanced."""
    ahead = copy.deepcopy(random_state)
    return np.random.RandomState([_APART, *ahead.randint(0, 2**32, 4, dtype=np.uint32)])


def _of_scene(whole: Appearance, settings: AppearanceSettings) -> Appearance:
    """Leave out what settings don't change, so that it stays as in the scene file."""

    def is_set(*names: str) -> bool:
        return any(getattr(settings, name) != getattr(MINIMAL, name) for name in names)

    kept = {SemanticClass.SKY: is_set("sky_horizon", "sky_zenith"), SemanticClass.GROUND: False}
    return dataclasses.replace(
        whole,
        colors={of: color for of, color in whole.colors.items() if kept.get(of, True)},
        ambient=whole.ambient if is_set("ambient_strength") else None,
        sun=whole.sun if is_set("sun_strength", "sun_color") else None,
        sun_direction=whole.sun_direction if is_set("sun_elevation", "sun_azimuth") else None,
    )


def _object(
    settings: ObjectAppearance, color: Callable[[], Tensor], number: Callable[[], Tensor]
) -> ObjectLook:
    own, cover = color(), _cover(settings.texture, number(), number())
    return ObjectLook(color=None if settings.color is None else own, texture=cover)


def _cover(names: Names | None, choice: Tensor, tile: Tensor) -> Texture | None:
    images = tuple(name for name in names or () if name != NO_TEXTURE)
    return Texture(images=images, size=tile, choice=choice) if images else None
