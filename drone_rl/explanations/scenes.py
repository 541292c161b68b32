"""Scenes that were met or imagined: drawn, shown to the policy, and taken apart into objects."""

import enum
from collections.abc import Iterable, Sequence

import torch
from torch import Tensor
from torch.nn import functional
from torchrl.envs import CatFrames, Transform, TransformedEnv

from drone_rl.envs import ChromaticityPixels, CropRows, RgbPixels, worlds_of
from drone_rl.envs.transforms import memory_of, see_film
from drone_rl.sim.rendering import Appearance
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.tasks import State


class Region(enum.IntEnum):
    """What a pixel shows."""

    NEXT_TARGET = 0
    OTHER_TARGET = 1
    HORIZON = 2
    GROUND = 3
    SKY = 4


def _channels(transforms: Iterable[Transform]) -> str:
    kinds = {type(transform) for transform in transforms}
    if ChromaticityPixels in kinds:
        return "chromaticity"
    return "rgb" if RgbPixels in kinds else "gray"


class Scenes:
    """Draws any `State` as the policy's camera sees it, or would.

    A scene is a still: where the policy's pipeline stacks frames, it gets the same one N times, as
    it does at the start of an episode.
    """

    def __init__(self, env: TransformedEnv) -> None:
        """Borrows the worlds and the transforms of an environment."""
        self.worlds = worlds_of(env)
        self.task = self.worlds.task
        self.actions = self.worlds.dynamics.actions
        pipeline: Iterable[Transform] = env.transform  # type: ignore[assignment]
        self._transforms = [t for t in pipeline if "pixels" in (t.in_keys or [])]
        self.channels: str = _channels(self._transforms)
        """Of what the policy gets: "gray", "rgb", or "chromaticity" (of red and blue)."""
        self.memory: int = memory_of(self._transforms)
        """Pictures before the present one that the policy gets."""

    def frames(self, state: State, appearance: Appearance | None = None) -> Tensor:
        """RGB pictures. Shape: (T, H, W, 3), uint8."""
        return self.worlds.render(state, appearance=appearance)

    def depth(self, state: State) -> Tensor:
        """Metres along the optical axis, 0 for the sky. Shape: (T, H, W)."""
        return self.worlds.render(state, self.worlds.view(modality="depth"))

    def transform(self, frames: Tensor, earlier: Sequence[Tensor] = ()) -> Tensor:
        """RGB pictures as the policy gets them.

        Args:
            frames: Shape (T, H, W, 3).
            earlier: Those of the steps before, oldest first; the oldest repeats what is missing.

        Returns:
            Shape: (T, C, h, w).
        """
        return see_film(self._transforms, [*earlier, frames])

    def to_frame(self, maps: Tensor) -> Tensor:
        """Heat maps over what the policy gets, put back to where that is in the camera's frame.

        Args:
            maps: Shape (T, h, w).

        Returns:
            Shape: (T, H, W); 0 where the pipeline cropped the frame.
        """
        camera = self.worlds.camera
        pixels = torch.zeros(1, camera.height, camera.width, 3, dtype=torch.uint8)
        steps = []
        for transform in self._transforms:
            before = pixels.shape[-2:] if pixels.shape[-1] != 3 else pixels.shape[1:3]
            if not isinstance(transform, CatFrames):
                pixels = transform._apply_transform(pixels)
                steps.append((transform, before))
        for transform, size in reversed(steps):
            if isinstance(transform, CropRows):
                below = size[0] - transform.bottom
                maps = functional.pad(maps, (0, 0, transform.top, below))
            elif maps.shape[-2:] != size:
                maps = functional.interpolate(maps[:, None], size, mode="bilinear")[:, 0]
        return maps

    def needed(self, offset: Tensor) -> Tensor:
        """The action that a target calls for which stands there; -1 where nobody knows.

        A task tells what to do with the actions of its own choice of dynamics; among others it is
        the part that is called the same.

        Args:
            offset: Metres from the drone, world frame. Shape: (N, 3).
        """
        names, known = self.actions.names, self.task.make_dynamics().actions.names
        if not set(known) <= set(names):
            return torch.full(offset.shape[:1], -1)
        same = torch.tensor([*(names.index(name) for name in known), -1], device=offset.device)
        return same[self.task.needed(offset)]  # -1 reads the last entry

    def observe(self, state: State) -> Tensor:
        """Scenes as the policy gets them. Shape: (T, C, h, w)."""
        return self.transform(self.frames(state))

    def regions(self, state: State) -> Tensor:
        """What each pixel shows, a `Region`. Shape: (T, H, W), uint8.

        The horizon is the lowest row of sky and the highest of ground, where they meet.
        """
        geoms = self.worlds.render(state, self.worlds.view(modality="segmentation")).long()
        props = torch.tensor([*self.worlds.scene.props, -1], device=geoms.device)
        cube = props[geoms]  # geom -1 (the sky) reads the last entry
        next_cube = self.task.next_target(state)[:, None, None]
        regions = torch.full_like(cube, Region.GROUND)
        sky = geoms < 0
        regions[sky] = Region.SKY
        regions[_border(sky, ~sky & (cube < 0))] = Region.HORIZON
        regions[cube >= 0] = Region.OTHER_TARGET
        regions[(cube >= 0) & (cube == next_cube)] = Region.NEXT_TARGET
        return regions.to(torch.uint8)


def _border(sky: Tensor, ground: Tensor) -> Tensor:
    """Pixels of sky right above ground, and of ground right below sky. Shape: (T, H, W)."""
    meets = sky[:, :-1] & ground[:, 1:]
    return functional.pad(meets, (0, 0, 0, 1)) | functional.pad(meets, (0, 0, 1, 0))


def place_target(scenes: Scenes, forward: Tensor, lateral: Tensor, height: float = 0.0) -> State:
    """Scenes with one target at each place and the drone at its origin.

    Args:
        scenes: Where they will be drawn.
        forward: Metres ahead of the drone. Shape: (T,).
        lateral: Metres to its left. Shape: (T,).
        height: Metres above it.
    """
    worlds = scenes.worlds
    ahead, aside = forward.double(), lateral.double()
    offset = torch.stack([ahead, aside, torch.full_like(ahead, height)], -1)
    return worlds.task.one_target(worlds.bodies(len(offset)), offset).to(worlds.device)


def empty_scene(scenes: Scenes) -> State:
    """One scene with no target at all."""
    return scenes.task.without_targets(place_target(scenes, torch.ones(1), torch.zeros(1)))


DARK_GROUND = Appearance(colors={SemanticClass.GROUND: (0.25, 0.25, 0.22)})
DARK = Appearance(colors={**DARK_GROUND.colors, SemanticClass.SKY: (0.3, 0.36, 0.45)})
BRIGHT = Appearance(
    colors={SemanticClass.GROUND: (0.75, 0.78, 0.7), SemanticClass.SKY: (0.9, 0.93, 0.97)}
)
PLACEMENTS = 3
"""Random placements of all the cubes."""


def alternatives(scenes: Scenes, state: State, seed: int = 0) -> dict[str, Tensor]:
    """Other pictures from where each drone is.

    Args:
        scenes: Where they are drawn.
        state: The scenes as they were.
        seed: Of the cubes' random places.

    Returns:
        By name, pictures as the policy gets them, shape (T, C, h, w): no cubes; targets elsewhere,
        `PLACEMENTS` times; ground and sky darker, and brighter.
    """
    generator = torch.Generator().manual_seed(seed)
    found = {"no targets": scenes.observe(scenes.task.without_targets(state))}
    for i in range(PLACEMENTS):
        other = scenes.task.elsewhere(state, scenes.worlds.camera, generator)
        found[f"targets elsewhere {i}"] = scenes.observe(other)
    for name, appearance in (("darker", DARK), ("brighter", BRIGHT)):
        found[name] = scenes.transform(scenes.frames(state, appearance))
    return found
