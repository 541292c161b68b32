"""Which kinds of shift a training knows, as its settings say: what is not left to opinion.

Whatever of looks, pictures, camera and task is not as by default touches the axes that name it. A
kind of shift of which one axis is touched counts as touched: nothing of it is new to the policy.
"""

from collections.abc import Mapping
from typing import Any

from drone_rl.config.configuration import as_config
from drone_rl.config.training import TrainSettings
from drone_rl.robustness.axes import AXES, GROUPS

_PARTS = ("task", "appearance", "camera", "transforms")
"""Of a training's settings, those that say what is seen and how it moves."""


def changed(settings: TrainSettings) -> set[str]:
    """Settings of looks, pictures, camera and task that are not as by default.

    Args:
        settings: A training's.

    Returns:
        Names as in appearance.exposure; transforms by theirs alone, as in transforms.noise.
    """
    default, told = (as_config(s) for s in (TrainSettings(), settings))
    return {
        f"{part}.{name}"
        for part in _PARTS
        for name in {*told[part], *default[part]}
        if _of(told[part], name) != _of(default[part], name)
    }


def touched_axes(settings: TrainSettings) -> list[str]:
    """Names of the axes of which a training knows something, in the order of `AXES`."""
    differs = changed(settings)
    return [axis.name for axis in AXES.values() if differs.intersection(axis.touched_by)]


def untouched_kinds(settings: TrainSettings) -> list[str]:
    """Kinds of shift of which a training touches no axis, in the order of `GROUPS`."""
    touched = {AXES[name].group for name in touched_axes(settings)}
    return [kind for kind in GROUPS if kind not in touched]


def _of(part: Mapping[str, Any], name: str) -> Any:
    return part.get(name)
