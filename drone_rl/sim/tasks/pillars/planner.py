"""The shortest way through a field whose pillars are known, lane by lane."""

import torch
from torch import Tensor

from drone_rl.config import PillarsSettings
from drone_rl.sim.actions import Move
from drone_rl.sim.tasks.pillars import rules

READS = ("drone", "rows", "next_row")
"""Entries of the information that `fly_through` looks at."""


def first_turn(settings: PillarsSettings, rows: Tensor, y: Tensor, next_row: Tensor) -> Tensor:
    """How far to turn before the next row, on the way through all rows with the fewest turns.

    Bellman's recursion over rows, from the last one: the turns from a lane on are those to the best
    lane of the next row, and from there on.

    Args:
        settings: The task's.
        rows: The y of the pillars, metres. Shape: (N, R, K).
        y: Of the drones. Shape: (N,).
        next_row: Index of the first row that is ahead. Shape: (N,).

    Returns:
        Metres to the left; 0 where no row is left or no lane leads through. Shape: (N,).
    """
    turns, is_open = rules.ways(settings, rows, y)
    between = (turns[:, :, None] - turns[:, None]).abs()
    cost = torch.zeros_like(turns)  # from each lane, beyond the last row
    for row in reversed(range(rows.shape[1])):
        through = torch.where(is_open[:, row], cost, torch.inf)
        here = (between + through[:, None]).amin(-1)
        is_ahead = next_row[:, None] < row
        at_next = next_row[:, None] == row
        cost = torch.where(is_ahead, here, torch.where(at_next, through, cost))
    total = turns.abs() + cost
    best = total.argmin(-1, keepdim=True)
    turn = turns.gather(-1, best)[:, 0]
    is_known = torch.isfinite(total.gather(-1, best)[:, 0]) & (next_row < rows.shape[1])
    return torch.where(is_known, turn, 0.0)


def fly_through(settings: PillarsSettings, drone: Tensor, rows: Tensor, next_row: Tensor) -> Tensor:
    """Turns between rows, and flies straight through them.

    Args:
        settings: The task's.
        drone: Position, metres. Shape: (N, 3).
        rows: The y of the pillars, metres. Shape: (N, R, K).
        next_row: Index of the first row that is not passed, R if there is none. Shape: (N, 1).

    Returns:
        Moves. Shape: (N,).
    """
    x, y = drone[:, 0].double(), drone[:, 1].double()
    ahead = settings.first_distance + settings.spacing * next_row[:, 0] - x
    # on the last row's goal, the line, the row itself may be behind already
    is_behind = ahead < -settings.touch_distance
    row = torch.where(is_behind, rows.shape[1], next_row[:, 0])
    turn = first_turn(settings, rows.double(), y, row)
    is_beside = ahead.abs() <= settings.touch_distance
    move = torch.full_like(row, Move.FORWARD)
    move[(turn > 0.5 * settings.step_length) & ~is_beside] = Move.LEFT
    move[(turn < -0.5 * settings.step_length) & ~is_beside] = Move.RIGHT
    return move
