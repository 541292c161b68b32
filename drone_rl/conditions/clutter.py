# pyright: reportAttributeAccessIssue=false
# pyright: reportOptionalMemberAccess=false
# (dm_control's models of XML are untyped.)
"""Things beside the way that mean nothing: as large, as high and as bright as what matters."""

from collections.abc import Sequence
from typing import Any

import torch
from dm_control import composer, mjcf
from torch import Tensor

from drone_rl.sim.meaning import Meaning
from drone_rl.sim.rendering.gray import LUMA
from drone_rl.sim.settings import BaseTaskSettings
from drone_rl.sim.tasks import Task
from drone_rl.utils.errors import InputError

MOST = 16
_KINDS = ("box", "sphere", "cylinder")
_BLUE = (0.2, 0.4, 1.0)
_AWAY = (2.0, 10.0)
"""Metres, from and to, by which they stand outside of where anything matters."""
_NAMES = {
    "collect_cubes": ("cube_size", "cube_color", "lateral_bound"),
    "pillars": ("width", "pillar_color", "spread"),
}
"""What a task calls the size and the colour of things, and how far to the side they stand."""


class Distractor(composer.Entity):
    """A box, a ball or a cylinder."""

    meaning = Meaning.OBSTACLE

    def _build(self, kind: str, size: float, color: Sequence[float], name: str) -> None:
        self._mjcf_root = mjcf.RootElement(model=name)
        self._mjcf_root.worldbody.add(
            "geom",
            name="geom",
            type=kind,
            size=(size / 2,) * 3,
            rgba=(*color, 1.0),
            contype=0,
            conaffinity=0,
        )

    @property
    def mjcf_model(self) -> mjcf.RootElement:
        """Its MJCF root."""
        return self._mjcf_root


class Cluttered:
    """A task with distractors behind its own props; all else is the task's."""

    def __init__(self, task: Task[Any], settings: BaseTaskSettings, count: int) -> None:
        """Takes a task.

        Args:
            task: Which.
            settings: The task's.
            count: Distractors.
        """
        self._task, self._count = task, count
        self._size, own, _ = told_by(settings)
        self._color = as_bright(own)

    def __getattr__(self, name: str) -> Any:
        """Returns what the task has."""
        return getattr(self._task, name)

    def make_props(self) -> list[Any]:
        """See `Playable`; the task's own come first."""
        kinds = (_KINDS[i % len(_KINDS)] for i in range(self._count))
        more = (
            Distractor(kind, self._size, self._color, name=f"distractor_{i}")
            for i, kind in enumerate(kinds)
        )
        return [*self._task.make_props(), *more]


def told_by(settings: BaseTaskSettings) -> tuple[float, tuple[float, float, float], float]:
    """Size and colour of a task's things, and how far to the side they stand.

    Raises:
        InputError: Nothing is known of such a task.
    """
    if settings.name not in _NAMES:
        raise InputError(f"axes=distractors is not for task={settings.name}; leave it out of axes")
    size, color, bound = (getattr(settings, name) for name in _NAMES[settings.name])
    return size, color, bound


def as_bright(color: Sequence[float]) -> tuple[float, ...]:
    """A blue that is as bright as a colour, as far as there is one."""
    wanted, has = (sum(w * c for w, c in zip(LUMA, rgb, strict=True)) for rgb in (color, _BLUE))
    return tuple(min(1.0, wanted / has * c) for c in _BLUE)


def draw_places(settings: BaseTaskSettings, num_worlds: int, generator: torch.Generator) -> Tensor:
    """Where distractors stand; fewer of them are the first of these.

    Args:
        settings: The task's.
        num_worlds: How many.
        generator: Where they are drawn from.

    Returns:
        Metres, world frame. Shape: (num_worlds, MOST, 3), float64.
    """
    settings_: Any = settings
    bound, (near, far) = told_by(settings)[2], _AWAY
    drawn = torch.rand(num_worlds, MOST, 3, generator=generator, dtype=torch.float64)
    ahead = settings_.first_distance / 2 + drawn[..., 0] * settings_.last_distance
    aside = (bound + near + drawn[..., 1] * (far - near)) * (2.0 * drawn[..., 2].round() - 1.0)
    return torch.stack([ahead, aside, torch.full_like(ahead, settings_.altitude)], -1)
