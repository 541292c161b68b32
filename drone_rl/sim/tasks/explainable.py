"""What explanations must know of a task: its targets, and the changes that they ask for."""

from collections.abc import Mapping
from typing import NamedTuple, Protocol

import torch
from torch import Tensor

from drone_rl.config import CameraSettings
from drone_rl.sim.dynamics import BodyState
from drone_rl.sim.tasks.playable import S


class Grid(NamedTuple):
    """Places at which targets can stand, metres from the drone, as three axes of float64."""

    height: Tensor  # (Z,)
    forward: Tensor  # (F,)
    lateral: Tensor  # (L,)


class Explainable(Protocol[S]):
    """A task with targets: props to which the drone goes, or around which it must go.

    A target is known by the number of its prop. Worlds that are asked for are new ones; those that
    are given stay as they are.
    """

    @property
    def remembered(self) -> Mapping[str, str]:
        """What data sets keep of each frame: entry and description.

        "next_target" is always the number of the next target, as many as there are if none is left.
        """
        ...

    def remember(self, info: Mapping[str, Tensor]) -> dict[str, Tensor]:
        """The entries `remembered`, made of the information before an action. Shapes: (T, *)."""
        ...

    def tally(self, info: Mapping[str, Tensor]) -> tuple[Tensor, Tensor]:
        """How many goals are reached, and how many missed for good. Shapes: (T,), int64."""
        ...

    def recall(self, kept: Mapping[str, Tensor], body: BodyState) -> S:
        """The worlds as they stood.

        Args:
            kept: The entries `remembered`, and "step".
            body: The drones.
        """
        ...

    def next_target(self, state: S) -> Tensor:
        """The target that calls for action now; their number if none does. Shape: (N,)."""
        ...

    def next_offset(self, state: S) -> Tensor:
        """Where that stands, metres from the drone; NaN where there is none. Shape: (N, 3)."""
        ...

    def is_reached(self, state: S, target: Tensor) -> Tensor:
        """Whether a target of each world is done. Shape of both: (N,)."""
        ...

    def is_behind(self, state: S, target: Tensor) -> Tensor:
        """Whether a target of each world, or its place, lies behind the drone. Shape: (N,)."""
        ...

    def needed(self, offset: Tensor) -> Tensor:
        """The action that a target calls for which stands there. (N, 3) to (N, *)."""
        ...

    def stratum_at(self, offset: Tensor) -> Tensor:
        """The stratum of a target that stands there. (N, 3) to (N,)."""
        ...

    def grid(self, num_forward: int, num_lateral: int) -> Grid:
        """Places at which a next target can stand, seen from the drone; symmetric sideways."""
        ...

    def one_target(self, body: BodyState, offset: Tensor) -> S:
        """Worlds with a single target, at that place seen from each drone. Shape: (N, 3)."""
        ...

    def without_targets(self, state: S) -> S:
        """With no target left."""
        ...

    def without_next(self, state: S) -> S:
        """With the next target taken away, if there is one."""
        ...

    def next_moved(self, state: S, metres: Tensor | float) -> S:
        """With the next target moved to the left by so much. Shape: (N,), or one for all."""
        ...

    def elsewhere(self, state: S, camera: CameraSettings, generator: torch.Generator) -> S:
        """With all targets at random places in view of the camera."""
        ...
