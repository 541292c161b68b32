"""Everywhere a drone can come, move by move, past cubes at given places, by the task's own rules.

In computer-vision mode every move is a step forward, to the left or to the right, so a drone is
always on a lattice. Its place there, and which cubes it has collected, is a *cell*: that decides
the picture it sees and what each move leads to. A cell says nothing of how many steps it took.

What a lattice is depends on the cubes only through what touches what. So over a box of placements
in which neither that nor any cell's picture changes, all chances are the same.
"""

import dataclasses
import math
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from drone_rl.sim.batch import Batch
from drone_rl.sim.dynamics import BodyState
from drone_rl.sim.dynamics.computer_vision import DIRECTIONS
from drone_rl.sim.settings import TaskSettings
from drone_rl.sim.tasks.collect_cubes import rules
from drone_rl.sim.tasks.collect_cubes.rules import EndReason, WorldState
from drone_rl.utils.errors import InputError

MOST_CELLS = 2**24
"""Of one placement, reachable or not; bounds memory."""


@dataclasses.dataclass
class Cells(Batch):
    """Some cells; `K` is how many."""

    placement: Tensor  # (K,) int64
    """Which placement of the cubes."""
    ahead: Tensor  # (K,) int64
    """Steps forward from the origin."""
    aside: Tensor  # (K,) int64
    """Steps to the left of it; below 0 to the right."""
    collected: Tensor  # (K,) int64
    """Cubes collected on the way here; bit k says whether cube k is one of them."""


class Shape(NamedTuple):
    """How many values each part of a cell can have: those of `Cells`, without the placement."""

    ahead: int
    aside: int
    collected: int

    @property
    def cells(self) -> int:
        """Of one placement."""
        return self.ahead * self.aside * self.collected


@dataclasses.dataclass
class Lattice:
    """All cells that can be reached by any moves, and what each move leads to; `A` moves."""

    settings: TaskSettings
    cubes: Tensor  # (P, C, 3) float64
    """The placements, metres."""
    cells: Cells
    """The first P are where the episodes start, in the placements' order."""
    target: Tensor  # (K, A) int64
    """Number of the cell that a move leads to; -1 where the episode ends."""
    reason: Tensor  # (K, A) int64
    """Why it ends, an `EndReason`; never for its length, of which cells know nothing."""
    collected: Tensor  # (K, A) int64
    """Cubes collected after the move, as in `Cells`."""

    def states(self) -> WorldState:
        """The cells as worlds that can be drawn."""
        return states(self.settings, self.cubes, self.cells)

    def pictures(self) -> tuple[Tensor, Tensor]:
        """Which cells look different, by place and standing cubes.

        Which of the cubes behind the drone were collected can't be seen.

        Returns:
            The number of a cell that shows each picture, and of the picture that each cell shows.
            Shapes: (U,), (K,).
        """
        standing = dataclasses.replace(self.cells, collected=_as_bits(self.states().present))
        keys, picture = _keys(shape_of(self.settings), standing).unique(return_inverse=True)
        cell = torch.empty_like(keys)
        cell[picture] = torch.arange(len(picture))  # whichever cell is written last is one of them
        return cell, picture


def explore(settings: TaskSettings, cubes: Tensor) -> Lattice:
    """Follows every move from the start of the episodes until no cell is new.

    Args:
        settings: The task's.
        cubes: Placements, metres, world frame. Shape: (P, C, 3), float64.

    Raises:
        InputError: The task has too many cells.
    """
    shape = shape_of(settings)
    count = len(cubes)
    number = torch.full((count * shape.cells,), -1)
    zeros = torch.zeros(count, dtype=torch.int64)
    frontier = Cells(torch.arange(count), zeros, zeros, zeros)
    parts, known = [], 0
    while len(frontier):
        number[_keys(shape, frontier)] = torch.arange(known, known + len(frontier))
        known += len(frontier)
        moved, reason = follow(settings, cubes, frontier)
        goes_on = reason == EndReason.RUNNING
        keys = torch.where(goes_on.flatten(), _keys(shape, moved), -1).view(reason.shape)
        parts.append((frontier, keys, reason, moved.collected.view(reason.shape)))
        new = keys[goes_on].unique()
        frontier = _cells(shape, new[number[new] < 0])
    cells, keys, reason, collected = zip(*parts, strict=True)
    key = torch.cat(keys)
    return Lattice(
        settings,
        cubes,
        Cells(*(torch.cat(values) for values in zip(*map(_values, cells), strict=True))),
        target=torch.where(key < 0, -1, number[key]),
        reason=torch.cat(reason),
        collected=torch.cat(collected),
    )


def follow(settings: TaskSettings, cubes: Tensor, cells: Cells) -> tuple[Cells, Tensor]:
    """What every move makes of some cells, by `rules.judge`.

    Returns:
        The cells after each move, those of the first cell first (K * A), and the `EndReason` of
        each, which is never the step limit. Shape: (K, A).
    """
    moves = torch.tensor(DIRECTIONS).long()
    each = torch.arange(len(cells)).repeat_interleave(len(moves))
    before = cells[each]
    ahead, aside, _ = (moves.repeat(len(cells), 1)).unbind(-1)
    moved = dataclasses.replace(before, ahead=before.ahead + ahead, aside=before.aside + aside)
    body = BodyState.at_rest(_positions(settings, moved))
    judged, _ = rules.judge(settings, states(settings, cubes, before), body)
    moved.collected = _as_bits(judged.collected)
    return moved, judged.end_reason.view(len(cells), len(moves))


def states(settings: TaskSettings, cubes: Tensor, cells: Cells) -> WorldState:
    """Cells as worlds, one step short of having taken none: the step limit is never met."""
    body = BodyState.at_rest(_positions(settings, cells))
    state = rules.start(settings, cubes[cells.placement], body)
    bit = torch.arange(cubes.shape[1])
    state.collected = (cells.collected[:, None] >> bit & 1).bool()
    state.passed = ~state.collected & (state.drone[:, None, 0] > state.cubes[..., 0])
    state.steps = state.steps - 1
    return state


def shape_of(settings: TaskSettings) -> Shape:
    """How many cells there can be.

    Raises:
        InputError: Too many.
    """
    ahead = math.ceil(settings.front_bound / settings.step_length) + 2
    aside = 2 * (math.ceil(settings.side_bound / settings.step_length) + 1) + 1
    shape = Shape(ahead, aside, 2**settings.num_cubes)
    if shape.cells > MOST_CELLS:
        raise InputError(
            f"num_cubes={settings.num_cubes} and step_length={settings.step_length} make "
            f"{shape.cells:.2g} cells of each placement; give fewer cubes or longer steps, for at "
            f"most {MOST_CELLS:.2g}"
        )
    return shape


def _positions(settings: TaskSettings, cells: Cells) -> Tensor:
    """Metres, each the sum that as many steps straight on make, rounded alike. Shape: (K, 3).

    So x is the simulator's to the last bit, and y is if the drone came straight or if steps are
    sums of halves, quarters and so on; otherwise the simulator's y hangs on the way by some 1e-15.
    """
    farthest = max(int(cells.ahead.max()), int(cells.aside.abs().max()))
    steps = np.full(farthest + 1, settings.step_length)
    steps[0] = 0.0
    metres = torch.from_numpy(np.add.accumulate(steps))
    y = metres[cells.aside.abs()] * cells.aside.sign()
    return torch.stack([metres[cells.ahead], y, torch.full_like(y, settings.altitude)], -1)


def _as_bits(flags: Tensor) -> Tensor:
    """Truth values as one whole number. Shapes: (K, C), (K,)."""
    return (flags.long() << torch.arange(flags.shape[1])).sum(-1)


def _keys(shape: Shape, cells: Cells) -> Tensor:
    """A number for each cell, of its own. Shape: (K,)."""
    row = cells.placement * shape.ahead + cells.ahead
    place = row * shape.aside + cells.aside + shape.aside // 2
    return place * shape.collected + cells.collected


def _cells(shape: Shape, keys: Tensor) -> Cells:
    """The cells of keys."""
    place, collected = keys // shape.collected, keys % shape.collected
    row, column = place // shape.aside, place % shape.aside
    return Cells(row // shape.ahead, row % shape.ahead, column - shape.aside // 2, collected)


def _values(cells: Cells) -> tuple[Tensor, ...]:
    return cells.placement, cells.ahead, cells.aside, cells.collected
