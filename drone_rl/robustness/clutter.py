"""Distractors beside the way: as large, as high and as bright as what matters."""

import dataclasses
from collections.abc import Sequence

import torch
from torch import Tensor

from drone_rl.config import BaseTaskSettings
from drone_rl.config.task import Things
from drone_rl.sim.clutter import stand
from drone_rl.sim.rendering import Appearance, Beside
from drone_rl.sim.rendering.view import LUMA
from drone_rl.utils.errors import InputError

MOST = 16
_BLUE = (0.2, 0.4, 1.0)
_AWAY = (2.0, 10.0)
"""Metres, from and to, by which they stand outside of where anything matters."""


def told_by(settings: BaseTaskSettings) -> Things:
    """Where a task's things stand, how large and of which colour.

    Raises:
        InputError: Nothing is known of such a task.
    """
    if settings.things is None:
        raise InputError(f"axes=distractors is not for task={settings.name}; leave it out of axes")
    return settings.things


def as_bright(color: Sequence[float]) -> tuple[float, ...]:
    """A blue that is as bright as a colour, as far as there is one."""
    wanted, has = (sum(w * c for w, c in zip(LUMA, rgb, strict=True)) for rgb in (color, _BLUE))
    return tuple(min(1.0, wanted / has * c) for c in _BLUE)


def draw_places(things: Things, num_worlds: int, generator: torch.Generator) -> Tensor:
    """Where distractors stand; fewer of them are the first of these.

    Args:
        things: Of the task.
        num_worlds: How many.
        generator: Where they are drawn from.

    Returns:
        Metres, world frame. Shape: (num_worlds, MOST, 3), float64.
    """
    near, far = _AWAY
    drawn = torch.rand(num_worlds, MOST, 3, generator=generator, dtype=torch.float64)
    ahead = things.first / 2 + drawn[..., 0] * things.last
    is_left = drawn[..., 2].round().bool()
    return stand(things, ahead, near + drawn[..., 1] * (far - near), is_left, things.altitude)


def clutter(appearance: Appearance | None, things: Things, places: Tensor) -> Appearance:
    """The same look with more distractors.

    Args:
        appearance: As in the model by default.
        things: Of the task.
        places: Where they stand. Shape: (num_worlds, count, 3).
    """
    color = torch.tensor(as_bright(things.color)).to(places)
    more = Beside(
        places=places,
        sizes=torch.full_like(places[..., 0], things.size),
        colors=color.expand(places.shape),
    )
    appearance = appearance or Appearance()
    own = appearance.beside
    return dataclasses.replace(appearance, beside=more if own is None else own.and_more(more))
