"""Lanes through a field of pillars: sample fields that can be crossed, and plan the path.

A drone that moves in steps is always in one of finitely many lanes, a step apart. Between two rows
it can change to any lane, so a field can be crossed if and only if each row leaves a lane open.
"""

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.config import PillarsSettings
from drone_rl.sim.actions import Move

EDGE = 1e-6
"""Metres by which rounding may move a lane at the field's edge, also in float32."""
MOST_TRIES = 10_000
"""Largest number of samples of a row until one leaves a lane open."""


class Lanes:
    """Lanes a step apart, which a row of pillars leaves open or not. Metres, world frame."""

    def __init__(self, settings: PillarsSettings) -> None:
        self.settings = settings

    def sample_field(self, random_state: np.random.RandomState) -> NDArray[np.float64]:
        """Sample the y of all pillars of a field that can be crossed. Shape: (R, K)."""
        s = self.settings
        rows, closed = np.empty((s.num_rows, s.row_size)), np.ones(s.num_rows, bool)
        for _ in range(MOST_TRIES):
            rows[closed] = random_state.uniform(-s.spread, s.spread, (closed.sum(), s.row_size))
            closed = ~self.is_open(rows).any(-1)
            if not closed.any():
                return rows
        raise RuntimeError(f"no row with an open lane in {MOST_TRIES} samples; lower the density")

    def within_field(self) -> NDArray[np.float64]:
        """Return the y of all lanes within the field, from right to left. Shape: (L,)."""
        step = self.settings.step_length
        most = int(self.settings.spread / step + 1e-9)
        return np.arange(-most, most + 1, dtype=np.float64) * step

    def is_open(self, rows: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which lanes within the field are open in each row. (*, K) to (*, L)."""
        away = np.abs(rows[..., None, :] - self.within_field()[:, None])
        return np.asarray((away > self.settings.touch_distance).all(-1))

    def lanes_from(self, rows: Tensor, y: Tensor) -> tuple[Tensor, Tensor]:
        """Return lanes relative to drones, and which of them are open and within the field.

        The y of pillars, (N, R, K), and of drones, (N,), to metres to the left of the drone,
        (N, L), and whether open, (N, R, L).
        """
        step, edge = self.settings.step_length, self.settings.spread + EDGE
        count = int(2.0 * edge / step) + 1
        first = step * torch.ceil((-edge - y) / step)
        offsets = first[:, None] + step * torch.arange(count, dtype=y.dtype, device=y.device)
        lane = y[:, None] + offsets
        away = (rows[:, :, None] - lane[:, None, :, None]).abs().amin(-1)
        return offsets, (away > self.settings.touch_distance) & (lane <= edge)[:, None]

    def first_sidestep(self, rows: Tensor, y: Tensor, next_row: Tensor) -> Tensor:
        """Plan the path through all rows with the shortest sidesteps, by Bellman's recursion.

        The y of pillars, (N, R, K), and of drones, (N,), and the index of the first row ahead,
        (N,), to metres to move left before it, (N,); 0 if no row is left or none can be crossed.
        """
        offsets, is_open = self.lanes_from(rows, y)
        between = (offsets[:, :, None] - offsets[:, None]).abs()
        cost = torch.zeros_like(offsets)  # from each lane, beyond the last row
        for row in reversed(range(rows.shape[1])):
            through = torch.where(is_open[:, row], cost, torch.inf)
            here = (between + through[:, None]).amin(-1)
            is_ahead = next_row[:, None] < row
            at_next = next_row[:, None] == row
            cost = torch.where(is_ahead, here, torch.where(at_next, through, cost))
        total = offsets.abs() + cost
        best = total.argmin(-1, keepdim=True)
        sidestep = offsets.gather(-1, best)[:, 0]
        is_known = torch.isfinite(total.gather(-1, best)[:, 0]) & (next_row < rows.shape[1])
        return torch.where(is_known, sidestep, 0.0)

    def fly_through(self, drone: Tensor, rows: Tensor, next_row: Tensor) -> Tensor:
        """Return the oracle's moves, (N,): sidestep between rows, fly straight through them.

        Positions, (N, 3), the y of pillars, (N, R, K), the first row not passed or R, (N, 1).
        """
        s, x, y = self.settings, drone[:, 0].double(), drone[:, 1].double()
        ahead = s.first_distance + s.spacing * next_row[:, 0] - x
        # once the last row is behind, only the line is left
        row = torch.where(ahead < -s.touch_distance, rows.shape[1], next_row[:, 0])
        sidestep = self.first_sidestep(rows.double(), y, row)
        is_beside = ahead.abs() <= s.touch_distance
        move = torch.full_like(row, Move.FORWARD)
        move[(sidestep > 0.5 * s.step_length) & ~is_beside] = Move.LEFT
        move[(sidestep < -0.5 * s.step_length) & ~is_beside] = Move.RIGHT
        return move
