"""Whether there is room for what an appearance puts into a task's world: camera and distractors."""

from typing import Any

from drone_rl.config.appearance import AppearanceSettings
from drone_rl.config.camera import FRONT, CameraSettings
from drone_rl.config.task import Things
from drone_rl.utils.errors import InputError

_LEAST_HEIGHT = 0.05
"""Metres above the ground, below which the camera would see through it."""
_NARROWEST, _WIDEST = 1.0, 170.0
"""Degrees; see `CameraSettings.horizontal_fov`."""


def check_appearance(
    settings: AppearanceSettings, camera: CameraSettings, things: Things | None, task: str
) -> None:
    """Refuses what can't stand where it would.

    Args:
        settings: How worlds look.
        camera: The policy's.
        things: Where targets and obstacles stand; none where nothing is known of that.
        task: Its name.

    Raises:
        InputError: Distractors have no place, the camera is in something when an episode begins, or
            it sees too much or too little.
    """
    _check_view(settings, camera)
    if things is None:
        if _ends(settings.distractors)[1]:
            raise InputError(
                f"appearance.distractors={_ends(settings.distractors)[1]}: task={task} does not "
                "say where its things stand, so nothing can stand beside them; give distractors=0"
            )
        return
    (_, forward), (most_right, most_left), (lowest, _) = _sides(settings.camera_offset)
    _check_height(lowest, things)
    aside = max(most_left, -most_right)
    reach = things.first - things.size / 2 - FRONT[0]
    if forward >= reach:
        raise InputError(
            f"appearance.camera_offset={forward:g} forward puts the camera into the first thing "
            f"that stands there; give less than {reach:g}"
        )
    room = things.bound + _ends(settings.distractor_distance)[0]
    if _ends(settings.distractors)[1] and aside >= room:
        raise InputError(
            f"appearance.camera_offset={aside:g} aside puts the camera into a distractor; give "
            f"less than {room:g}, or a greater distractor_distance"
        )


def _check_view(settings: AppearanceSettings, camera: CameraSettings) -> None:
    own = camera.horizontal_fov
    for widening in _ends(settings.camera_widening):
        if not _NARROWEST <= own + widening <= _WIDEST:
            raise InputError(
                f"appearance.camera_widening={widening:g} makes a field of view of "
                f"{own + widening:g} degrees; give {_NARROWEST - own:g} to {_WIDEST - own:g}"
            )


def _check_height(lowest: float, things: Things) -> None:
    if things.altitude + lowest < _LEAST_HEIGHT:
        raise InputError(
            f"appearance.camera_offset={lowest:g} up puts the camera into the ground; give "
            f"{_LEAST_HEIGHT - things.altitude:g} or more"
        )


def _ends(value: Any) -> tuple[float, float]:
    """The lowest and the highest that a value can be."""
    return value if isinstance(value, tuple) else (value, value)


def _sides(value: Any) -> list[tuple[float, float]]:
    """The same of each of three."""
    low, high = value if isinstance(value[0], tuple) else (value, value)
    return [*zip(low, high, strict=True)]
