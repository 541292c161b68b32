# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled bindings are untyped.)
"""A compiled model of a task's world, in which everything that is drawn has a meaning."""

import dataclasses

import mujoco

from drone_rl.sim.meaning import Meaning


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
