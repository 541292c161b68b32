# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled bindings are untyped.)
"""A compiled model of a task's world, in which everything that is drawn has a meaning."""

import dataclasses

import mujoco

from drone_rl.sim.meaning import Meaning
from drone_rl.utils.errors import InputError


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
        """Numbers of the geoms that a view shows."""
        return [i for i, m in enumerate(self.meanings) if show_drone or m is not Meaning.DRONE]

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
