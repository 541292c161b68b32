"""Cube collection as simulators know it: rules and entities together."""

import enum
from collections.abc import Mapping

import numpy as np
import torch
from torch import Tensor

from drone_rl.config import TaskSettings
from drone_rl.sim.actions import Entry
from drone_rl.sim.dynamics import BodyState, ComputerVision
from drone_rl.sim.entities import Cube
from drone_rl.sim.tasks.collect_cubes import rules
from drone_rl.sim.tasks.collect_cubes.rules import EndReason, Side, WorldState

VANISHED_DEPTH = 100.0
"""Metres below its place at which a vanished cube is kept, out of sight under the floor."""


class Playing:
    """See `Playable`."""

    settings: TaskSettings
    ends: type[enum.IntEnum] = EndReason
    truncation: int = EndReason.STEP_LIMIT
    observed: tuple[str, ...] = ("cubes", "collected", "side", "end_reason")

    @property
    def largest_reward(self) -> float:
        """One a cube."""
        return float(self.settings.num_cubes)

    @property
    def drone_size(self) -> float:
        """Edge in metres of the box around the drone that touches cubes."""
        return self.settings.drone_size

    @property
    def origin(self) -> tuple[float, float, float]:
        """Where the drone starts, metres."""
        return rules.origin(self.settings)

    @property
    def entries(self) -> Mapping[str, Entry]:
        """Algorithm 3's info, and where the cubes are.

        Cubes collected, which, on which side and how far aside each became the next one, which is
        the next one, why the episode ended, and their positions (metres, world frame).
        """
        cubes = self.settings.num_cubes
        return {
            "cubes": Entry((1,), torch.int64, 0, cubes),
            "collected": Entry((cubes,), torch.bool),
            "side": Entry((cubes,), torch.int64, -1, len(Side) - 1),
            "lateral": Entry((cubes,), torch.float64),
            "next_cube": Entry((1,), torch.int64, 0, cubes),
            "end_reason": Entry((1,), torch.int64, 0, len(EndReason) - 1),
            "cube_positions": Entry((cubes, 3), torch.float32),
        }

    def make_dynamics(self) -> ComputerVision:
        """The chapter's three moves (Table 1)."""
        return ComputerVision(self.settings.step_length)

    def make_props(self) -> list[Cube]:
        """The cubes, nearest first."""
        size, color = self.settings.cube_size, self.settings.cube_color
        return [Cube(size, color, name=f"cube_{i}") for i in range(self.settings.num_cubes)]

    def draw(self, random_state: np.random.RandomState) -> Tensor:
        """Places of the cubes (Algorithm 2). Shape: (num_cubes, 3)."""
        return rules.draw_cubes(self.settings, random_state)

    def start(self, drawn: Tensor, body: BodyState) -> WorldState:
        """The state at the start of episodes."""
        return rules.start(self.settings, drawn, body)

    def judge(self, state: WorldState, body: BodyState) -> tuple[WorldState, Tensor]:
        """Algorithms 1 and 3."""
        return rules.judge(self.settings, state, body)

    def places(self, state: WorldState) -> Tensor:
        """The cubes at their places, or under the floor once vanished."""
        hidden = (~state.present).double() * VANISHED_DEPTH
        return state.cubes - torch.nn.functional.pad(hidden[..., None], (2, 0))

    def obstacles(self, state: WorldState) -> None:
        """None: cubes are touched, not hit."""
        del state

    def info(self, state: WorldState) -> dict[str, Tensor]:
        """See `entries`."""
        return {
            "cubes": state.collected.sum(-1, keepdim=True),
            "collected": state.collected.clone(),
            "side": state.side.clone(),
            "lateral": state.lateral.clone(),
            "next_cube": state.next_cube[:, None],
            "end_reason": state.end_reason[:, None].clone(),
            "cube_positions": state.cubes.float(),
        }
