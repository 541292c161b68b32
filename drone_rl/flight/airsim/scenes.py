"""Scenes of the server as tasks: cubes, blocks, pillars, an empty field, and scene files."""

import dataclasses
import logging
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from drone_rl.config import DynamicsSettings, TaskSettings
from drone_rl.sim.dynamics import BodyState, Obstacles
from drone_rl.sim.entities import Pillar, SceneEntity, VisualEntity
from drone_rl.sim.quiet_dm_control import mjcf
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.scenes import SceneFile, load_scene, scene_names
from drone_rl.sim.scenes.solids import PlacedSolids, Solids, solids_of
from drone_rl.sim.tasks import CollectCubes, Task, as_task
from drone_rl.utils.errors import InputError, did_you_mean

_log = logging.getLogger(__name__)
SCENES = ("cubes", "blocks", "pillars", "empty")
_BLOCK = (4.0, 4.0)
"""Width and height of a block, metres."""
_HIGHEST = 100.0
"""Metres that a start of a file may be above the ground."""
_ACROSS = 31
"""Points across a region in which vehicles may start."""
_UNEVEN = 0.05
"""Metres by which floors are uneven."""


class _Fixed(Task[Any]):
    """A scene without rules: entities at fixed places.

    `solid` has the half sizes, in metres, of the boxes around the first `count` places, by default
    all, that can be touched.
    """

    name = "scene"
    scenes: tuple[SceneFile, ...] = ()

    def __init__(
        self,
        entities: Sequence[Any],
        places: Tensor,
        solid: Sequence[float] | None,
        count: int | None = None,
    ) -> None:
        self._entities, self._places, self._solid = entities, places, solid
        self._count = count

    def make_props(self) -> Sequence[Any]:
        """Return the entities."""
        return self._entities

    def sample(self, random_state: np.random.RandomState) -> Tensor:
        """Return the places. Shape: (P, 3)."""
        return self._places.clone()

    def places(self, state: Any) -> Tensor:
        """Return the places. Shape: (N, P, 3)."""
        return state.sampled

    def obstacles(self, state: Any) -> Obstacles | None:
        """Return the boxes that can be touched."""
        if self._solid is None:
            return None
        x, y, z = self._solid
        return Obstacles(state.sampled[:, : self._count], (x, y, z))

    def step(self, state: Any, body: BodyState) -> tuple[Any, Tensor]:
        """Apply no rule."""
        reward = torch.zeros(len(state), dtype=torch.float64)
        return dataclasses.replace(state, body=body), reward


class _InFile(_Fixed):
    """A scene file, placed so that vehicles start on what is below its first site start*.

    In a region they start near to its middle, but not on furniture; without such a site they start
    at the file's origin, or else near to it in free space.
    """

    def __init__(self, path: str) -> None:
        scene = load_scene(path)
        for warning in scene.warnings:
            _log.warning("scene=%s: %s", path, warning)
        self.scenes = (scene,)
        self.solids = solids_of(self.scenes, "cpu")
        start, fall = _find_start(scene, self.solids)
        self.origin = (0.0, 0.0, fall)
        place = (start.new_tensor(self.origin) - start)[None]
        super().__init__([SceneEntity(scene, name=scene.name)], place, None)

    def obstacles(self, state: Any) -> Obstacles | None:
        """Return the solids of the file."""
        placed = PlacedSolids(self.solids, state.sampled, DynamicsSettings().radius)
        return Obstacles(state.sampled[:, :0], (0.0, 0.0, 0.0), placed)


def _find_start(scene: SceneFile, solids: Solids) -> tuple[Tensor, float]:
    """Return a free place in the file, (3,), and how far it is above what is below, metres."""
    radius = DynamicsSettings().radius
    low, high = scene.bounds
    middle, half = (low + high) / 2, (high - low) / 2
    near, heights, heading = np.zeros(2), [middle[2], high[2] + 2 * radius], 0.0
    sites = [site for site in scene.sites if site.name.startswith("start")]
    stand = torch.tensor([[0.0, 0.0, radius]], dtype=torch.float64)
    if not sites and float(solids.distances(stand)) >= radius:
        return stand.new_tensor(_Fixed.origin), _Fixed.origin[2]
    for site in sites[:1]:
        middle, half = np.array(site.position), np.array(site.half_size)
        near, heights, heading = middle[:2], [middle[2]], math.radians(site.heading)
    across = [np.linspace(-reach, reach, _ACROSS if reach else 1) for reach in half[:2]]
    x, y = np.stack(np.meshgrid(*across), -1).reshape(-1, 2).T
    cos, sin = math.cos(heading), math.sin(heading)
    flat = middle[:2] + np.stack([cos * x - sin * y, sin * x + cos * y], -1)
    flat = np.concatenate([near[None], flat])
    flat = flat[np.hypot(*(flat - near).T).argsort(kind="stable")]
    for height in heights:
        points = torch.from_numpy(np.column_stack([flat, np.full(len(flat), height)]))
        free = points[solids.distances(points) >= radius]
        below = free - free.new_tensor([0.0, 0.0, _HIGHEST])
        fall = _HIGHEST * solids.sweep(free, below, radius).fraction + radius
        free, fall = free[fall.isfinite()], fall[fall.isfinite()]
        if len(free):
            first = int((fall >= fall.median() - _UNEVEN).nonzero()[0])
            return free[first], float(fall[first])
    return torch.from_numpy(np.append(near, heights[0])), 0.0


def make_task(scene: str) -> Task[Any]:
    """Return the task that a name, or the path of a scene file, means.

    Raises:
        InputError: There is no such scene, or the file can't be read.
    """
    if scene == "cubes":
        return CollectCubes(TaskSettings())
    if scene == "pillars":
        return as_task("pillars")
    if scene == "empty":
        return _Fixed([], torch.zeros(0, 3, dtype=torch.float64), None)
    if scene == "blocks":
        return _blocks()
    if scene in scene_names() or Path(scene).suffix or Path(scene).exists():
        return _InFile(scene)
    known = (*SCENES, *scene_names())
    raise InputError(
        f"scene={scene} is unknown; give {', '.join(known)}, or the path of an MJCF file or a mesh"
        f"{did_you_mean(scene, known)}"
    )


def _blocks() -> Task[Any]:
    """Blocks in a grid around the start, with streets between them, and objects of AirSim's Blocks.

    Vehicles fly through all but the blocks.
    """
    width, height = _BLOCK
    grid = [(x, y) for x in range(-24, 49, 12) for y in range(-24, 25, 12) if (x, y) != (0, 0)]
    places = torch.tensor([(x, y, height / 2) for x, y in grid], dtype=torch.float64)
    shades = ((0.62, 0.6, 0.56), (0.55, 0.57, 0.62), (0.66, 0.58, 0.5))
    blocks = [
        Pillar(width, height, shades[i % len(shades)], name=f"block_{i}") for i in range(len(grid))
    ]
    orange, gray, white = (0.95, 0.45, 0.1), (0.5, 0.5, 0.5), (0.9, 0.9, 0.9)
    steps = [((0.3 * (5 - i), 0.25), 0.5 * i - 1.0) for i in range(5)]
    others = [
        (_Landmark("OrangeBall", [("sphere", (1.0,), 0.0)], orange), (6.0, -4.0, 1.0)),
        (_Landmark("PulsingCone", [("cylinder", *of) for of in steps], white), (6.0, 4.0, 1.25)),
        (_Landmark("Cylinder", [("cylinder", (0.75, 1.5), 0.0)], gray), (18.0, 6.0, 1.5)),
    ]
    beside = torch.tensor([place for _, place in others], dtype=torch.float64)
    return _Fixed(
        [*blocks, *(one for one, _ in others)],
        torch.cat([places, beside]),
        (width / 2, width / 2, height / 2),
        len(blocks),
    )


class _Landmark(VisualEntity):
    """An object of geoms on one axis: their types, sizes, and heights above its centre, metres."""

    semantic_class = SemanticClass.OBSTACLE

    def _build(
        self,
        name: str,
        geoms: Sequence[tuple[str, Sequence[float], float]],
        color: Sequence[float],
    ) -> None:
        self._mjcf_root = mjcf.RootElement(model=name)
        for kind, size, z in geoms:
            self._mjcf_root.worldbody.add(
                "geom", type=kind, size=size, pos=(0, 0, z), rgba=(*color, 1)
            )
