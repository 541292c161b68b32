"""Worlds of cube collection that were never drawn: cubes taken away, moved, or put elsewhere."""

import dataclasses
import math

import torch
from torch import Tensor

from drone_rl.config import CameraSettings, TaskSettings
from drone_rl.sim.dynamics import BodyState
from drone_rl.sim.tasks.collect_cubes import rules
from drone_rl.sim.tasks.collect_cubes.rules import WorldState
from drone_rl.sim.tasks.explainable import Grid


def is_next(state: WorldState) -> Tensor:
    """Which cube is the next one. Shape: (N, C), bool."""
    index = torch.arange(state.cubes.shape[1], device=state.drone.device)
    return index == state.next_cube[:, None]


def next_offset(state: WorldState) -> Tensor:
    """Where the next cube stands, metres from the drone; NaN where there is none. (N, 3)."""
    last = state.cubes.shape[1] - 1
    world = torch.arange(len(state), device=state.drone.device)
    away = state.cubes[world, state.next_cube.clamp(max=last)] - state.drone
    return torch.where((state.next_cube <= last)[:, None], away, torch.nan)


def one_cube(settings: TaskSettings, body: BodyState, offset: Tensor) -> WorldState:
    """Worlds whose only cube stands there, seen from each drone.

    Args:
        settings: The task's.
        body: The drones.
        offset: Metres, world frame. Shape: (N, 3).
    """
    places = body.position[:, None].repeat(1, settings.num_cubes, 1)
    places[:, 0] += offset.to(places)
    state = rules.start(settings, places, body)
    state.passed[:, 1:] = True  # the other cubes are not there
    return state


def without_cubes(state: WorldState) -> WorldState:
    """The worlds with no cube left."""
    return dataclasses.replace(state, passed=torch.ones_like(state.passed))


def without_next(state: WorldState) -> WorldState:
    """The next cube left out."""
    return dataclasses.replace(state, passed=state.passed | is_next(state))


def next_moved(state: WorldState, metres: Tensor | float) -> WorldState:
    """The next cube moved to the left by so much."""
    cubes = state.cubes.clone()
    move = torch.as_tensor(metres, dtype=cubes.dtype, device=cubes.device).expand(len(state))
    cubes[..., 1] += move[:, None] * is_next(state)
    return dataclasses.replace(state, cubes=cubes)


def elsewhere(
    settings: TaskSettings, state: WorldState, camera: CameraSettings, generator: torch.Generator
) -> WorldState:
    """All cubes standing at random places in view.

    All columns of the picture alike; ahead from where a cube just fits before the camera to where
    the first one stands at the start; no farther sideways than cube and drone ever are.
    """
    draw = torch.rand(*state.cubes.shape, generator=generator, dtype=torch.float64)
    edge = math.tan(math.radians(camera.horizontal_fov / 2))
    slope = (2 * draw[..., 1] - 1) * edge
    nearest = settings.touch_distance + settings.cube_size
    widest = 2 * settings.lateral_bound / slope.abs().clamp_min(1e-9)
    farthest = widest.clamp(max=settings.first_distance).clamp(min=nearest)
    ahead = nearest + draw[..., 0] * (farthest - nearest)
    up = (2 * draw[..., 2] - 1) * settings.vertical_bound
    away = torch.stack([ahead, slope * ahead, up], -1).to(state.drone)
    standing = torch.zeros_like(state.passed)
    return dataclasses.replace(
        state, cubes=state.drone[:, None] + away, passed=standing, collected=standing.clone()
    )


def grid(settings: TaskSettings, num_forward: int, num_lateral: int) -> Grid:
    """Metres up, ahead and to the left at which cubes can stand, seen from the drone.

    Ahead: from all but touching to where an episode's first cube stands. Sideways: symmetric, as
    far as a next cube ever stands. Up: where the task places them; level, lowest and highest.
    """
    reach = 2.0 * settings.lateral_bound or settings.touch_distance * 2
    nearest = settings.touch_distance + 0.5 * settings.step_length
    bound = settings.vertical_bound
    height = torch.tensor([-bound, 0.0, bound] if bound else [0.0], dtype=torch.float64)
    forward = torch.linspace(nearest, settings.first_distance, num_forward).double()
    return Grid(height, forward, torch.linspace(reach, -reach, num_lateral).double())
