"""What simulators must know of a task: what stands where, how an episode starts, what is good."""

import enum
from collections.abc import Mapping, Sequence
from typing import Any, Protocol, Self, TypeVar

import numpy as np
import torch
from dm_control import mjcf
from torch import Tensor

from drone_rl.sim.actions import Entry
from drone_rl.sim.dynamics import BodyState, Dynamics, Obstacles
from drone_rl.sim.rendering.scene import SemanticClass


class State(Protocol):
    """Worlds of a task. A `Batch` has all of it but for the fields."""

    body: BodyState
    """The drones."""
    steps: Tensor  # (num_worlds,) int64
    """Taken in this episode."""
    end_reason: Tensor  # (num_worlds,) int64
    """Why it ended, one of `Playable.ends`."""

    def __len__(self) -> int:
        """Returns the number of worlds."""
        ...

    def __getitem__(self, worlds: Tensor) -> Self:
        """Returns some worlds (a copy)."""
        ...

    def __setitem__(self, worlds: Tensor, other: Self) -> None:
        """Overwrites some worlds."""
        ...

    def to(self, device: torch.device | str) -> Self:
        """Returns the same on another device."""
        ...

    def tensors(self) -> dict[str, Any]:
        """All that there is to know of them, by name, nested."""
        ...

    def with_tensors(self, tensors: Mapping[str, Any]) -> Self:
        """Others that `tensors` told of."""
        ...


S = TypeVar("S", bound=State)


class Prop(Protocol):
    """A dm_control entity that the task puts into the world, and where."""

    semantic_class: SemanticClass

    @property
    def mjcf_model(self) -> mjcf.RootElement:
        """Its model."""
        ...


class Playable(Protocol[S]):
    """Rules of a world. It holds no world: states come in, states go out, many at once."""

    @property
    def name(self) -> str:
        """What people call it."""
        ...

    @property
    def ends(self) -> type[enum.IntEnum]:
        """Why an episode ends; 0 says that it goes on."""
        ...

    @property
    def truncation(self) -> int:
        """The one of `ends` that says nothing of what would have come: the episode is cut off."""
        ...

    @property
    def observed(self) -> tuple[str, ...]:
        """Entries of the information that dm_control's observations hold."""
        ...

    @property
    def largest_reward(self) -> float:
        """What a perfect episode earns."""
        ...

    @property
    def drone_size(self) -> float:
        """Edge in metres of the box around the drone."""
        ...

    @property
    def origin(self) -> tuple[float, float, float]:
        """Where the drone starts, metres, world frame."""
        ...

    @property
    def entries(self) -> Mapping[str, Entry]:
        """What `info` tells of each world."""
        ...

    def make_dynamics(self) -> Dynamics:
        """How the drone moves unless the user wants otherwise."""
        ...

    def make_props(self) -> Sequence[Prop]:
        """New entities of all that stands in the world besides field and drone, in a fixed order.

        Their frames are mocap bodies: `places` says where they are.
        """
        ...

    def draw(self, random_state: np.random.RandomState) -> Tensor:
        """Draws what is random about an episode, of one shape for all."""
        ...

    def start(self, drawn: Tensor, body: BodyState) -> S:
        """The state at the start of episodes.

        Args:
            drawn: From `draw`. First dimension: worlds.
            body: The drones at `origin`.
        """
        ...

    def judge(self, state: S, body: BodyState) -> tuple[S, Tensor]:
        """What comes of a move.

        Args:
            state: Before it.
            body: The drones after it.

        Returns:
            The state after it, and the reward, float64, shape (num_worlds,).
        """
        ...

    def places(self, state: S) -> Tensor:
        """Where the props are; out of sight what is not there any more.

        Returns:
            Metres, world frame. Shape: (num_worlds, number of props, 3).
        """
        ...

    def obstacles(self, state: S) -> Obstacles | None:
        """What the drones can fly into, for dynamics that know contacts; None where nothing is."""
        ...

    def info(self, state: S) -> dict[str, Tensor]:
        """The truth about each world, as `entries` has it. Shapes: (num_worlds, *)."""
        ...
