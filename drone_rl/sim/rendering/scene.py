# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled bindings are untyped.)
"""A compiled model of a task's world, in which everything that is drawn has a meaning."""

import dataclasses
import enum

import mujoco
import numpy as np
from numpy.typing import NDArray

from drone_rl.utils.errors import InputError


class Meaning(enum.IntEnum):
    """Of one thing. Which target is the next one is not told here: that is the state's business."""

    SKY = 0
    GROUND = 1
    TARGET = 2
    OBSTACLE = 3
    DRONE = 4
    DISTRACTOR = 5


_UNSET = (0.5, 0.5, 0.5, 1.0)
"""Of a geom that was given none."""


@dataclasses.dataclass(frozen=True)
class Scene:
    """The model that all simulators and renderers share, and what its geoms are."""

    model: mujoco.MjModel
    meanings: tuple[Meaning, ...]
    """Of each geom."""
    props: tuple[int, ...]
    """The task's prop that each geom belongs to, by number; -1 for what belongs to none."""
    sky: tuple[float, float, float]
    """Red, green, blue in [0, 1] where nothing else is."""

    def geoms(self, meaning: Meaning) -> list[int]:
        """Numbers of the geoms with a meaning."""
        return [i for i, found in enumerate(self.meanings) if found is meaning]

    def seen(self, show_drone: bool) -> list[int]:
        """Numbers of the geoms that a view shows; none of those that nothing is to be seen of."""
        of_things = zip(self.meanings, self.colors[:, 3], strict=True)
        return [
            i
            for i, (meaning, opacity) in enumerate(of_things)
            if opacity > 0 and (show_drone or meaning is not Meaning.DRONE)
        ]

    @property
    def colors(self) -> NDArray[np.float32]:
        """Red, green, blue and opacity of each geom.

        As in MuJoCo, the material's where the geom has the colour that it has by default.
        """
        model, colors = self.model, self.model.geom_rgba.copy()
        is_materials = (model.geom_matid >= 0) & (colors == _UNSET).all(1)
        colors[is_materials] = model.mat_rgba[model.geom_matid[is_materials]]
        return colors

    def camera(self, name: str) -> int:
        """Number of a camera.

        Raises:
            InputError: There is none of that name.
        """
        number = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_CAMERA, name)
        if number < 0:
            names = ", ".join(self.model.camera(i).name for i in range(self.model.ncam))
            raise InputError(f"camera {name!r} is not in the model; choose from: {names}")
        return number
