"""The indoor example scene, and random free places in it."""

import copy
from typing import Any

import mujoco as _mujoco
import numpy as np
import torch
from numpy.typing import NDArray

from drone_rl.config import BaseTaskSettings
from drone_rl.sim.scenes.scene_file import SceneFile, load_scene
from drone_rl.sim.tasks import State
from drone_rl.sim.worlds import Worlds

mujoco: Any = _mujoco
"""MuJoCo's bindings, which are untyped."""
INDOOR = "indoor"
_ROOM = 0.35
"""Least distance to the scene in each of 26 directions, metres."""
_WAYS = np.array(
    [(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if x or y or z]
)


def reach(scene: str = INDOOR) -> BaseTaskSettings:
    """Return the settings of the task `reach` in a scene."""
    return BaseTaskSettings.read({"name": "reach", "scene": [scene]}, "task")


def put_at_random(worlds: Worlds, seed: int = 0) -> State:
    """Return a state in which the drones are at random free places, with random headings."""
    rng = np.random.default_rng(seed)
    places = free_places(load_scene(INDOOR), worlds.num_envs, rng)
    half = torch.from_numpy(rng.uniform(-np.pi, np.pi, worlds.num_envs) / 2)
    state = copy.deepcopy(worlds.state)
    state.body.position[:] = torch.from_numpy(places)
    zero = torch.zeros_like(half)
    state.body.attitude[:] = torch.stack([half.cos(), zero, zero, half.sin()], -1)
    return state


def free_places(scene: SceneFile, count: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return places in regions of a scene's starts that are clear of its geoms. Shape: (count, 3).

    A region is chosen in proportion to its area.
    """
    model, data = scene.model, mujoco.MjData(scene.model)
    mujoco.mj_forward(model, data)
    regions = [site for site in scene.sites if site.name.startswith("start")]
    areas = np.array([site.half_size[0] * site.half_size[1] for site in regions])
    found: list[NDArray[np.float64]] = []
    geom = np.zeros(1, np.int32)
    while len(found) < count:
        region = regions[rng.choice(len(regions), p=areas / areas.sum())]
        place = np.array(region.position) + rng.uniform(-1, 1, 3) * region.half_size
        ways = _WAYS / np.linalg.norm(_WAYS, axis=1, keepdims=True)
        far = [mujoco.mj_ray(model, data, place, way, None, 1, -1, geom) for way in ways]
        if all(distance < 0 or distance > _ROOM for distance in far):
            found.append(place)
    return np.array(found)
