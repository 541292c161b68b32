"""What the simulator would draw otherwise: pictures from the same place with other things in them.

They are what a patch of a picture is replaced by, to find out whether the policy minds: a grey box
is something that no policy ever met, these are pictures like its own.
"""

import dataclasses
import math

import torch
from torch import Tensor

from drone_rl.explain.scenes import Scenes
from drone_rl.sim.meaning import Meaning
from drone_rl.sim.rendering import Appearance
from drone_rl.sim.tasks.collect_cubes.rules import WorldState

DARK_GROUND = Appearance(colors={Meaning.GROUND: (0.25, 0.25, 0.22)})
DARK = Appearance(colors={**DARK_GROUND.colors, Meaning.SKY: (0.3, 0.36, 0.45)})
BRIGHT = Appearance(colors={Meaning.GROUND: (0.75, 0.78, 0.7), Meaning.SKY: (0.9, 0.93, 0.97)})
PLACEMENTS = 3
"""Random placements of all the cubes."""


def alternatives(scenes: Scenes, state: WorldState, seed: int = 0) -> dict[str, Tensor]:
    """Other pictures from where each drone is.

    Args:
        scenes: Where they are drawn.
        state: The scenes as they were.
        seed: Of the cubes' random places.

    Returns:
        By name, pictures as the policy gets them, shape (T, C, h, w): no cubes; cubes elsewhere,
        `PLACEMENTS` times; ground and sky darker, and brighter.
    """
    generator = torch.Generator().manual_seed(seed)
    found = {"no cubes": scenes.observe(without_cubes(state))}
    for i in range(PLACEMENTS):
        found[f"cubes elsewhere {i}"] = scenes.observe(cubes_elsewhere(scenes, state, generator))
    for name, appearance in (("darker", DARK), ("brighter", BRIGHT)):
        found[name] = scenes.transform(scenes.frames(state, appearance))
    return found


def without_cubes(state: WorldState) -> WorldState:
    """The scenes with no cube left."""
    return dataclasses.replace(state, passed=torch.ones_like(state.passed))


def cubes_elsewhere(scenes: Scenes, state: WorldState, generator: torch.Generator) -> WorldState:
    """The scenes with all cubes standing at random places in view.

    All columns of the picture alike; ahead from where a cube just fits before the camera to where
    the first one stands at the start; no farther sideways than cube and drone ever are.
    """
    settings, camera = scenes.worlds.task.settings, scenes.worlds.camera
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
