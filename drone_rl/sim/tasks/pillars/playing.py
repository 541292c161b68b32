"""Flying through pillars as simulators know it: rules and entities together."""

import enum
from collections.abc import Mapping

import numpy as np
import torch
from torch import Tensor

from drone_rl.config import PillarsSettings
from drone_rl.sim.actions import Entry
from drone_rl.sim.dynamics import BodyState, ComputerVision, Obstacles
from drone_rl.sim.entities import Pillar
from drone_rl.sim.tasks.pillars import field, rules
from drone_rl.sim.tasks.pillars.rules import EndReason, FieldState, Side

VANISHED_DEPTH = 100.0
"""Metres below its place at which a pillar is kept that does not stand, out of sight."""


class Playing:
    """See `Playable`."""

    settings: PillarsSettings
    ends: type[enum.IntEnum] = EndReason
    truncation: int = EndReason.STEP_LIMIT
    observed: tuple[str, ...] = ("passed", "side", "end_reason")
    largest_reward = 1.0

    @property
    def drone_size(self) -> float:
        """Edge in metres of the box around the drone."""
        return self.settings.drone_size

    @property
    def origin(self) -> tuple[float, float, float]:
        """Where the drone starts, metres."""
        return (0.0, 0.0, self.settings.altitude)

    @property
    def entries(self) -> Mapping[str, Entry]:
        """What became of the rows, and where the pillars are.

        Which rows are passed; on which side the way through each lay, and how wide the gap was, as
        it came up; which row is the next one; why the episode ended; the y of the pillars (metres,
        infinite where none stands); pillars touched.
        """
        rows, size, pillars = (
            getattr(self.settings, n) for n in ("num_rows", "row_size", "num_pillars")
        )
        return {
            "passed": Entry((rows,), torch.bool),
            "touched": Entry((pillars,), torch.bool),
            "side": Entry((rows,), torch.int64, -1, len(Side) - 1),
            "gap": Entry((rows,), torch.float64),
            "next_row": Entry((1,), torch.int64, 0, rows),
            "end_reason": Entry((1,), torch.int64, 0, len(EndReason) - 1),
            "rows": Entry((rows, size), torch.float32),
        }

    def make_dynamics(self) -> ComputerVision:
        """The chapter's three moves (Table 1)."""
        return ComputerVision(self.settings.step_length)

    def make_props(self) -> list[Pillar]:
        """The pillars, row by row."""
        s = self.settings
        names = (f"pillar_{i}" for i in range(s.num_pillars))
        return [Pillar(s.width, s.height, s.pillar_color, name=name) for name in names]

    def draw(self, random_state: np.random.RandomState) -> Tensor:
        """The y of the pillars of a field that some path crosses. Shape: (R, K), metres."""
        return torch.from_numpy(field.draw_field(self.settings, random_state))

    def start(self, drawn: Tensor, body: BodyState) -> FieldState:
        """The state at the start of episodes."""
        return rules.start(self.settings, drawn, body)

    def judge(self, state: FieldState, body: BodyState) -> tuple[FieldState, Tensor]:
        """Progress, collisions, ends."""
        return rules.judge(self.settings, state, body)

    def places(self, state: FieldState) -> Tensor:
        """The pillars at their places, or under the floor where none stands."""
        hidden = (~state.present).double() * VANISHED_DEPTH
        return state.pillars - torch.nn.functional.pad(hidden[..., None], (2, 0))

    def obstacles(self, state: FieldState) -> Obstacles:
        """The pillars."""
        s = self.settings
        return Obstacles(self.places(state), (s.width / 2, s.width / 2, s.height / 2))

    def info(self, state: FieldState) -> dict[str, Tensor]:
        """See `entries`."""
        return {
            "passed": state.passed.clone(),
            "touched": state.touched.clone(),
            "side": state.side.clone(),
            "gap": state.gap.clone(),
            "next_row": state.next_row[:, None],
            "end_reason": state.end_reason[:, None].clone(),
            "rows": state.rows.float(),
        }
