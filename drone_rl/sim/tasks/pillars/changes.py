"""Fields of pillars that were never drawn: pillars taken away, moved, or put elsewhere."""

import dataclasses
import math

import torch
from torch import Tensor

from drone_rl.config import CameraSettings, PillarsSettings
from drone_rl.sim.dynamics import BodyState
from drone_rl.sim.tasks.explainable import Grid
from drone_rl.sim.tasks.pillars import rules
from drone_rl.sim.tasks.pillars.rules import FieldState


def next_pillar(state: FieldState) -> Tensor:
    """The standing pillar of the next row that is nearest to the drone's way; P if none. (N,)."""
    count = state.pillars.shape[1]
    rows = state.passed.shape[1]
    of = torch.arange(count, device=state.steps.device) // (count // rows)
    there = state.present & (of == state.next_row[:, None])
    aside = (state.pillars[..., 1] - state.drone[:, 1:2]).abs()
    nearest = torch.where(there, aside, torch.inf).argmin(-1)
    return torch.where(there.any(-1), nearest, count)


def next_offset(state: FieldState) -> Tensor:
    """Where that stands, level with the drone, metres from it; NaN where there is none. (N, 3)."""
    pillar = next_pillar(state)
    last = state.pillars.shape[1] - 1
    world = torch.arange(len(state), device=pillar.device)
    away = state.pillars[world, pillar.clamp(max=last)] - state.drone
    away = torch.cat([away[:, :2], torch.zeros_like(away[:, 2:])], -1)
    return torch.where((pillar <= last)[:, None], away, torch.nan)


def one_pillar(settings: PillarsSettings, body: BodyState, offset: Tensor) -> FieldState:
    """Worlds whose only pillar stands there, seen from each drone, in the first row.

    Args:
        settings: The task's.
        body: The drones.
        offset: Metres, world frame. Shape: (N, 3).
    """
    rows = offset.new_zeros(len(offset), settings.num_rows, settings.row_size).double()
    state = rules.start(settings, rows, body)
    state.pillars[:, 0, :2] = body.position[:, :2] + offset[:, :2].to(body.position)
    state.present[:, 1:] = False
    return state


def without_pillars(state: FieldState) -> FieldState:
    """The worlds with no pillar standing."""
    return dataclasses.replace(state, present=torch.zeros_like(state.present))


def _is_next(state: FieldState) -> Tensor:
    index = torch.arange(state.pillars.shape[1], device=state.steps.device)
    return index == next_pillar(state)[:, None]


def without_next(state: FieldState) -> FieldState:
    """The next pillar left out."""
    return dataclasses.replace(state, present=state.present & ~_is_next(state))


def next_moved(state: FieldState, metres: Tensor | float) -> FieldState:
    """The next pillar moved to the left by so much."""
    pillars = state.pillars.clone()
    move = torch.as_tensor(metres, dtype=pillars.dtype, device=pillars.device).expand(len(state))
    pillars[..., 1] += move[:, None] * _is_next(state)
    return dataclasses.replace(state, pillars=pillars)


def elsewhere(
    settings: PillarsSettings,
    state: FieldState,
    camera: CameraSettings,
    generator: torch.Generator,
) -> FieldState:
    """All pillars standing at random places in view, none of them at the drone.

    All columns of the picture alike; ahead from where a pillar just fits before the camera to
    where the second row stands at the start; no farther sideways than two fields' width.
    """
    draw = torch.rand(*state.pillars.shape[:2], 2, generator=generator, dtype=torch.float64)
    edge = math.tan(math.radians(camera.horizontal_fov / 2))
    slope = (2 * draw[..., 1] - 1) * edge
    nearest = settings.touch_distance + settings.width
    widest = 2 * settings.spread / slope.abs().clamp_min(1e-9)
    farthest = widest.clamp(max=settings.first_distance + settings.spacing).clamp(min=nearest)
    ahead = nearest + draw[..., 0] * (farthest - nearest)
    away = torch.stack([ahead, slope * ahead], -1).to(state.pillars)
    pillars = state.pillars.clone()
    pillars[..., :2] = state.drone[:, None, :2] + away
    return dataclasses.replace(state, pillars=pillars, present=torch.ones_like(state.present))


def grid(settings: PillarsSettings, num_forward: int, num_lateral: int) -> Grid:
    """Metres up, ahead and to the left at which pillars can stand, seen from the drone.

    Ahead: from all but touching to where an episode's first row stands. Sideways: symmetric, over
    the width of the field.
    """
    nearest = settings.touch_distance + 0.5 * settings.step_length
    forward = torch.linspace(nearest, settings.first_distance, num_forward).double()
    lateral = torch.linspace(settings.spread, -settings.spread, num_lateral).double()
    return Grid(torch.zeros(1, dtype=torch.float64), forward, lateral)
