"""Flying through pillars as explanations know it: pillars are what must be flown around."""

import types
from collections.abc import Mapping

import torch
from torch import Tensor

from drone_rl.config import CameraSettings, PillarsSettings
from drone_rl.sim.actions import Move
from drone_rl.sim.dynamics import BodyState
from drone_rl.sim.tasks.explainable import Grid
from drone_rl.sim.tasks.pillars import changes, rules
from drone_rl.sim.tasks.pillars.rules import FieldState, Side


class Explaining:
    """See `Explainable`."""

    settings: PillarsSettings
    remembered: Mapping[str, str] = types.MappingProxyType(
        {
            "rows": "y of the pillars, metres, row by row; infinite where none stands (T, R, K)",
            "passed": "whether each row has been passed, bool (T, R)",
            "next_target": "index of the pillar of the next row nearest to the way, P if none (T,)",
        }
    )

    def remember(self, info: Mapping[str, Tensor]) -> dict[str, Tensor]:
        """See `remembered`."""
        rows, y = info["rows"], info["drone"][:, 1]
        world = torch.arange(len(rows), device=rows.device)
        row, size = info["next_row"][:, 0], rows.shape[-1]
        aside = (rows[world, row.clamp(max=rows.shape[1] - 1)] - y[:, None]).abs()
        is_none = (row >= rows.shape[1]) | aside.isinf().all(-1)
        pillar = torch.where(is_none, rows[0].numel(), row * size + aside.argmin(-1))
        return {"rows": rows, "passed": info["passed"], "next_target": pillar}

    def tally(self, info: Mapping[str, Tensor]) -> tuple[Tensor, Tensor]:
        """Rows passed; none is missed while the flight goes on."""
        passed = info["passed"].sum(-1)
        return passed, torch.zeros_like(passed)

    def recall(self, kept: Mapping[str, Tensor], body: BodyState) -> FieldState:
        """The worlds as they stood, but for where rows were seen first."""
        rows = kept["rows"].double()
        standing = rows.isfinite()
        state = rules.start(self.settings, torch.where(standing, rows, 0.0), body)
        state.present, state.passed = standing.flatten(1), kept["passed"].clone()
        state.side, state.gap = (
            torch.full_like(state.side, -1),
            torch.full_like(state.gap, torch.nan),
        )
        state.steps = kept["step"].clone()
        return state

    def next_target(self, state: FieldState) -> Tensor:
        """The pillar of the next row that is nearest to the drone's way."""
        return changes.next_pillar(state)

    def next_offset(self, state: FieldState) -> Tensor:
        """From the drone to it."""
        return changes.next_offset(state)

    def is_reached(self, state: FieldState, target: Tensor) -> Tensor:
        """Whether the drone is past it and has touched none."""
        return self.is_behind(state, target) & ~state.touched.any(-1)

    def is_behind(self, state: FieldState, target: Tensor) -> Tensor:
        """Whether the drone is beyond its middle, from where it can only fly away from it."""
        world = torch.arange(len(state), device=target.device)
        return state.drone[:, 0] > state.pillars[world, target, 0]

    def needed(self, offset: Tensor) -> Tensor:
        """A turn away from it where flying straight on would touch it."""
        lateral = offset[..., 1]
        move = torch.full_like(lateral, Move.FORWARD, dtype=torch.int64)
        is_in_way = lateral.abs() <= self.settings.touch_distance
        move[is_in_way & (lateral > 0)] = Move.RIGHT
        move[is_in_way & (lateral <= 0)] = Move.LEFT
        return move

    def stratum_at(self, offset: Tensor) -> Tensor:
        """Where the way around it leads."""
        sides = torch.tensor([Side.AHEAD, Side.LEFT, Side.RIGHT], device=offset.device)
        return sides[self.needed(offset)]

    def grid(self, num_forward: int, num_lateral: int) -> Grid:
        """Wherever a pillar can stand."""
        return changes.grid(self.settings, num_forward, num_lateral)

    def one_target(self, body: BodyState, offset: Tensor) -> FieldState:
        """One pillar there; the others are not."""
        return changes.one_pillar(self.settings, body, offset)

    def without_targets(self, state: FieldState) -> FieldState:
        """No pillar standing."""
        return changes.without_pillars(state)

    def without_next(self, state: FieldState) -> FieldState:
        """The next pillar left out."""
        return changes.without_next(state)

    def next_moved(self, state: FieldState, metres: Tensor | float) -> FieldState:
        """The next pillar to the left by so much."""
        return changes.next_moved(state, metres)

    def elsewhere(
        self, state: FieldState, camera: CameraSettings, generator: torch.Generator
    ) -> FieldState:
        """All pillars at random places in view."""
        return changes.elsewhere(self.settings, state, camera, generator)
