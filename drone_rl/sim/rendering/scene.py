"""A compiled MuJoCo model of a task, with a semantic class for each geom."""

import dataclasses
import enum
from typing import Any, NamedTuple, Self

import mujoco as _mujoco
import numpy as np
from numpy.typing import NDArray

from drone_rl.sim.quiet_dm_control import mjcf
from drone_rl.utils.errors import InputError

mujoco: Any = _mujoco
"""MuJoCo's bindings, which are untyped."""
_UNSET = (0.5, 0.5, 0.5, 1.0)
"""MuJoCo's color of a geom that was given none."""
_HIDDEN_GROUPS = 3
"""The first group of geoms that is not rendered: collision geoms, by convention."""


def compiled(model: mjcf.RootElement, name: str) -> mjcf.Physics:
    """Return a compiled model; raise an `InputError` about `name` with MuJoCo's reason."""
    try:
        return mjcf.Physics.from_mjcf_model(model)
    except ValueError as error:
        lines = str(error).splitlines()
        reason = next((line for line in lines if line.startswith("Error: ")), lines[0])
        raise InputError(f"{name} can't be compiled by MuJoCo ({reason}); correct it") from error


class SemanticClass(enum.IntEnum):
    """Role of a geom in the task; it does not change during an episode."""

    SKY = 0
    GROUND = 1
    TARGET = 2
    OBSTACLE = 3
    DRONE = 4
    DISTRACTOR = 5
    DECORATION = 6


class Headlight(NamedTuple):
    """The light at the camera of a scene file. Colors in [0, 1]."""

    prop: int
    """The file's, see `Scene.props`; -1 for a light in all environments."""
    is_on: bool
    ambient: tuple[float, float, float]
    diffuse: tuple[float, float, float]
    specular: tuple[float, float, float]

    @classmethod
    def of(cls, model: Any, prop: int = -1) -> Self:
        """Return that of a `mujoco.MjModel`."""
        head = model.vis.headlight
        colors = (tuple(of.tolist()) for of in (head.ambient, head.diffuse, head.specular))
        return cls(prop, bool(head.active), *colors)


@dataclasses.dataclass(frozen=True)
class Scene:
    """The model that all simulators and renderers share, and what its geoms are."""

    model: Any
    """A `mujoco.MjModel`, whose bindings are untyped."""
    semantic_classes: tuple[SemanticClass, ...]
    props: tuple[int, ...]
    """Index of the prop that each geom belongs to, in the order of `Task.make_props()`, then of the
    distractors; -1 for none."""
    sky: tuple[float, float, float]
    """Background color: red, green, blue in [0, 1]."""
    is_file: bool = False
    """Whether the scene is from a file, so that its sky and lights are the file's own."""
    file_headlights: tuple[Headlight, ...] = ()
    """Those of the files, if there are any."""

    @property
    def headlights(self) -> tuple[Headlight, ...]:
        """The headlights of the files, or the model's, that are on."""
        every = self.file_headlights or (Headlight.of(self.model),)
        return tuple(one for one in every if one.is_on)

    def geoms(self, semantic_class: SemanticClass) -> list[int]:
        """Return the indices of the geoms of a class."""
        return [i for i, kind in enumerate(self.semantic_classes) if kind is semantic_class]

    def shown(self, show_drone: bool) -> list[int]:
        """Return the indices of visible geoms; without `show_drone`, not the drone's.

        As in MuJoCo's viewers, groups 0 to 2 are visible.
        """
        hidden = set[int]() if show_drone else {*self.geoms(SemanticClass.DRONE)}
        is_visible = (self.colors[:, 3] > 0) & (self.model.geom_group < _HIDDEN_GROUPS)
        return [i for i in np.flatnonzero(is_visible).tolist() if i not in hidden]

    @property
    def colors(self) -> NDArray[np.float32]:
        """Colors and opacity of geoms, or of their materials, in [0, 1]. Shape: (num_geoms, 4)."""
        model, colors = self.model, self.model.geom_rgba.copy()
        uses_material = (model.geom_matid >= 0) & (colors == _UNSET).all(1)
        colors[uses_material] = model.mat_rgba[model.geom_matid[uses_material]]
        return colors

    def camera(self, name: str) -> int:
        """Return the index of a camera; raise an `InputError` if there is none of that name."""
        try:
            return self.model.camera(name).id
        except KeyError as error:
            names = ", ".join(self.model.camera(i).name for i in range(self.model.ncam))
            raise InputError(
                f"camera {name!r} is not in the model; choose from: {names}"
            ) from error
