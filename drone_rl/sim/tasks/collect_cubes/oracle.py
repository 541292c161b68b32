"""How to steer at a cube whose place is known."""

import torch
from torch import Tensor

from drone_rl.config import TaskSettings
from drone_rl.sim.actions import Move

READS = ("drone", "cube_positions", "next_cube")
"""Entries of the information that `line_up` looks at."""


def turn_towards(lateral: Tensor, tolerance: float) -> Tensor:
    """The move for a cube that stands so many metres to the left. Shape kept.

    Args:
        lateral: Metres to the left of the drone.
        tolerance: Metres up to which flying straight on is right.
    """
    move = torch.full_like(lateral, Move.FORWARD, dtype=torch.int64)
    move[lateral > tolerance] = Move.LEFT
    move[lateral < -tolerance] = Move.RIGHT
    return move


def line_up(settings: TaskSettings, drone: Tensor, cubes: Tensor, next_cube: Tensor) -> Tensor:
    """Lines up with the next cube sideways, then flies forward.

    Args:
        settings: The task's.
        drone: Position, metres. Shape: (num_worlds, 3).
        cubes: Positions, metres. Shape: (num_worlds, C, 3).
        next_cube: Index of the next one, C if there is none. Shape: (num_worlds, 1).

    Returns:
        Moves. Shape: (num_worlds,).
    """
    nearest = next_cube.clamp(max=cubes.shape[-2] - 1)
    rows = nearest[..., None].expand(*next_cube.shape[:-1], 1, 3)
    offset = cubes.gather(-2, rows)[..., 0, 1] - drone[..., 1]
    move = turn_towards(offset, max(0.5 * settings.step_length, 0.5 * settings.touch_distance))
    is_done = next_cube[..., 0] >= cubes.shape[-2]  # no cube stands any more
    return move.masked_fill(is_done, Move.FORWARD)
