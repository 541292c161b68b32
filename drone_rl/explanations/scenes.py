"""Render any state as the policy observes it, and label the region of each pixel."""

import dataclasses
import enum
import functools
from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional
from torchrl.envs import CatFrames, EnvBase

from drone_rl.config.inputs import VectorInput
from drone_rl.envs import (
    CameraFault,
    ChromaticityPixels,
    CropRows,
    Observer,
    Pipeline,
    RgbPixels,
    base_env,
)
from drone_rl.envs.observer import ImageSource
from drone_rl.explanations.hooks import memory_in, rest_in
from drone_rl.sim.rendering import Appearance
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.rendering.view import View
from drone_rl.sim.tasks import State
from drone_rl.sim.tasks.common import HIDDEN_DEPTH
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import plain_generator
from drone_rl.utils.text import listed

DARK_GROUND = Appearance(colors={SemanticClass.GROUND: (0.25, 0.25, 0.22)})
DARK = Appearance(colors={**DARK_GROUND.colors, SemanticClass.SKY: (0.3, 0.36, 0.45)})
BRIGHT = Appearance(
    colors={SemanticClass.GROUND: (0.75, 0.78, 0.7), SemanticClass.SKY: (0.9, 0.93, 0.97)}
)
PLACEMENTS = 3  # random placements of all targets among the alternatives of a scene


_MIRRORED = {
    "goal": (1, -1, 1),
    "velocity": (1, -1, 1),
    "attitude": (1, -1, 1, -1),
    "rates": (-1, 1, -1),
    "altitude": (1,),
    "imu": (1, -1, 1, -1, 1, -1),
    "last_action": (1, -1, 1, -1),
}
"""Factors that make the mirror image of each vector, see `drone_rl.config.inputs.SIZES`."""


class Region(enum.IntEnum):
    """Content of a pixel."""

    NEXT_TARGET = 0
    OTHER_TARGET = 1
    HORIZON = 2
    GROUND = 3
    SKY = 4


class Scenes:
    """Renders any `State` as an input of an environment's policy, its observations.

    Where the transforms stack frames, a single frame is padded as at the start of an episode.
    """

    def __init__(self, env: EnvBase, name: str | None = None) -> None:
        """Take the environment and the name of the input, by default its first image, if any."""
        base = base_env(env)
        self.worlds, self.inputs = base.worlds, base.observer.inputs
        images = base.observer.images
        if name not in (None, *self.inputs):
            raise InputError(f"the policy does not see {name}, only {', '.join(self.inputs)}")
        self.name: str = name or next(iter([*images, *self.inputs]))
        """Name of the input."""
        self.image: ImageSource | None = images.get(self.name)
        """The input, if it is an image."""
        self.others: tuple[str, ...] = tuple(n for n in self.inputs if n != self.name)
        """The policy's other inputs, in order."""
        self.seen: str = listed([self.name, *self.others])
        """Names of all inputs, in a sentence."""
        self.view: View = self.worlds.policy_view
        """The image's camera, size and modality, or else the policy's camera."""
        self._transforms = self.image.transforms if self.image else ()
        self.task = self.worlds.task
        self.actions = self.worlds.dynamics.actions
        kinds = {type(transform) for transform in self._transforms}
        colors = {ChromaticityPixels: "chromaticity", RgbPixels: "rgb"}
        modality = "rgb"
        if self.image is not None:
            modality = self.image.modality
            self.view = dataclasses.replace(self.image.view, modalities=(modality,))
        default = {"normals": "rgb", "segmentation": "classes"}.get(modality, "gray")
        self.channels: str = next((name for kind, name in colors.items() if kind in kinds), default)
        """Channels of an image: "gray", "rgb", "chromaticity" (of red and blue), or "classes"."""
        self.shows_colors: bool = modality == "rgb"
        """Whether the image is one of colors."""
        self.memory: int = Pipeline(self._transforms).earlier
        """Number of earlier frames in observations."""
        is_faulty = any(isinstance(one, CameraFault) for one in self._transforms)
        self.is_ambiguous: bool = is_faulty or base.appearances.varies
        """Whether a state has several observations: camera faults, appearances with ranges."""

    def frames(self, state: State, appearance: Appearance | None = None) -> Tensor:
        """Render RGB frames. Shape: (T, H, W, 3), uint8."""
        view = dataclasses.replace(self.view, modalities=("rgb",))
        return self.worlds.render(state, view, appearance)

    def depth(self, state: State) -> Tensor:
        """Render metres along the optical axis, 0 for the sky. Shape: (T, H, W)."""
        return self.worlds.render(state, dataclasses.replace(self.view, modalities=("depth",)))

    def observe(self, state: State, appearance: Appearance | None = None) -> Tensor:
        """Return the observations of scenes. Shape: (T, C, h, w), or (T, n) of a vector."""
        if self.image is None:
            return self._observe(state)[self.name]
        return self._observed(self.worlds.render(state, self.view, appearance))

    def _observed(self, rendered: Tensor) -> Tensor:
        """Return observations, (T, C, h, w), of images that were rendered as in `view`."""
        assert self.image is not None
        return self.transform(self.image.measured(rendered))

    def rest(self, state: State) -> Tensor | None:
        """Return the other inputs in states where episodes start, see `hooks`."""
        seen = self._observe(state) if self.others else {}
        return rest_in({name: seen[name] for name in self.others})

    def rest_of(self, entries: Mapping[Any, Tensor]) -> Tensor | None:
        """Return what a policy read besides the observations in a step, given its entries."""
        memory = memory_in(entries)
        return rest_in({n: entries[n] for n in self.others}) if memory is None else memory

    def _observe(self, state: State) -> dict[str, Tensor]:
        rows = torch.arange(len(state), device=state.steps.device)
        return self.observer().observe(state, rows, True, None)

    def observe_empty(self, state: State) -> Tensor:
        """Return the observations of scenes without the task's objects. Shape: (T, C, h, w)."""
        worlds = self.worlds
        poses = worlds.poses(state, worlds.appearance)
        count = poses.props.shape[1] - worlds.distractors
        props = poses.props.clone()  # tasks may return their own tensors
        props[:, :count, 2] = -HIDDEN_DEPTH
        poses = dataclasses.replace(poses, props=props)
        (images,) = worlds.renderer.render(self.view, poses, worlds.appearance).values()
        return self._observed(images[:, 0])

    @functools.cached_property
    def absent(self) -> Tensor:
        """Observation of the scene without objects, where episodes start. Shape: (C, h, w).

        Zeros if it is a vector.
        """
        worlds = self.worlds
        if self.image is None:
            return torch.zeros_like(self.observe(worlds.state[:1])[0])
        state = worlds.start(worlds.task.sample(np.random.RandomState(0))[None])
        state.body = worlds.bodies(1).to(worlds.device)
        return self.observe_empty(state)[0]

    def transform(self, frames: Tensor) -> Tensor:
        """Apply the transforms to RGB frames. Shape: (T, H, W, 3) to (T, C, h, w)."""
        return Pipeline(self._transforms)(frames)

    def observer(self, appearance: Appearance | None = None) -> Observer:
        """Return what observes rollouts in one appearance, without camera faults."""
        return Observer(self.worlds, self.inputs, appearance=lambda rows: appearance)

    def mirror(self, name: str, values: Tensor) -> Tensor:
        """Return the mirror image of values (T, *) of an input."""
        seen = self.inputs[name]
        if isinstance(seen, VectorInput):
            return values * values.new_tensor(_MIRRORED[seen.quantity])
        return values.flip(-1)

    def to_frame(self, maps: Tensor) -> Tensor:
        """Transform heat maps back to the coordinates of the camera's frame.

        Shape: (T, h, w) to (T, H, W); 0 where a transform cropped the frame.
        """
        pixels, steps = self.worlds.render(self.worlds.state[:1], self.view), []
        pixels = pixels if self.image is None else self.image.measured(pixels)
        for transform in self._transforms:
            before = pixels.shape[-2:] if pixels.shape[-1] != 3 else pixels.shape[1:3]
            if not isinstance(transform, CatFrames):
                pixels = transform._apply_transform(pixels)
                steps.append((transform, before))
        for transform, size in reversed(steps):
            if isinstance(transform, CropRows):
                rows = transform.values
                maps = functional.pad(maps, (0, 0, rows.top, size[0] - rows.bottom))
            elif maps.shape[-2:] != size:
                maps = functional.interpolate(maps[:, None], size, mode="bilinear")[:, 0]
        return maps

    def needed(self, offset: Tensor) -> Tensor:
        """Return the action that a target calls for at an offset (N, 3), see `SceneEdits`.

        The task knows it for the actions of its default dynamics; for other actions it is the one
        that is `like` it. It is always -1 if any of these is missing.
        """
        parts = [self.actions.like(name) for name in self.task.make_dynamics().actions.names]
        if None in parts:
            return torch.full(offset.shape[:1], -1)
        same = torch.tensor([*parts, -1], device=offset.device)
        return same[self.task.edits.needed(offset)]  # -1 reads the last entry

    def regions(self, state: State) -> Tensor:
        """Return the `Region` of each pixel. Shape: (T, H, W), uint8.

        The horizon is the lowest row of sky and the highest of ground, where they meet. Distractors
        count as ground.
        """
        view = dataclasses.replace(self.view, modalities=("segmentation",))
        geoms = self.worlds.render(state, view).long()
        scene = self.worlds.scene
        props = torch.tensor([*scene.props, -1], device=geoms.device)
        clutter = [kind is SemanticClass.DISTRACTOR for kind in scene.semantic_classes]
        is_clutter = torch.tensor([*clutter, False], device=geoms.device)[geoms]
        target = torch.where(is_clutter, -1, props[geoms])  # geom -1 (the sky) reads the last entry
        sky, is_target = geoms < 0, target >= 0
        meets = sky[:, :-1] & ~(sky | is_target | is_clutter)[:, 1:]
        border = functional.pad(meets, (0, 0, 0, 1)) | functional.pad(meets, (0, 0, 1, 0))
        regions = torch.full_like(target, Region.GROUND)
        regions[sky] = Region.SKY
        regions[border] = Region.HORIZON
        regions[is_target] = Region.OTHER_TARGET
        if self.task.edits is not None:
            next_target = self.task.edits.next_target(state)[:, None, None]
            regions[is_target & (target == next_target)] = Region.NEXT_TARGET
        return regions.to(torch.uint8)


def place_target(scenes: Scenes, forward: Tensor, lateral: Tensor, height: float = 0.0) -> State:
    """Return T scenes with one target each, metres ahead of the drone and to its left, both (T,).

    The drone is at its origin; the target is `height` metres above it.
    """
    worlds = scenes.worlds
    ahead, aside = forward.double(), lateral.double()
    offset = torch.stack([ahead, aside, torch.full_like(ahead, height)], -1)
    return worlds.task.edits.one_target(worlds.bodies(len(offset)), offset).to(worlds.device)


def alternatives(scenes: Scenes, state: State, seed: int = 0) -> dict[str, Tensor]:
    """Return observations (T, C, h, w) from the same places with other contents, by name.

    These are: no objects; objects at random places, `PLACEMENTS` times, or if the task can't move
    any, the observations of other states; ground and sky darker, and brighter. Unlike a gray box,
    they are similar to observations that the policy was trained on.
    """
    generator = plain_generator(seed)
    observations = {"no objects": scenes.observe_empty(state)}
    for i in range(PLACEMENTS):
        if scenes.task.edits is not None:
            other = scenes.task.edits.elsewhere(state, scenes.worlds.camera, generator)
        else:
            other = state[torch.randperm(len(state), generator=generator).to(state.steps.device)]
        observations[f"objects elsewhere {i}"] = scenes.observe(other)
    for name, appearance in (("darker", DARK), ("brighter", BRIGHT)):
        observations[name] = scenes.observe(state, appearance)
    return observations
