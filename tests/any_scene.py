"""Scenes of any geoms, and rays through them by MuJoCo and by the ray tracer's functions."""

from typing import Any

import mujoco
import numpy as np
import warp as wp

from drone_rl.sim.rendering import Scene
from drone_rl.sim.rendering.devices import start_warp
from drone_rl.sim.rendering.raytrace import (
    cast_kernel,
    light_kernel,
    shadows_kernel,
    structs_kernel,
)
from drone_rl.sim.rendering.raytrace.world_renderer import SceneRaytracer
from drone_rl.sim.rendering.scene import SemanticClass
from tests import rays_kernel

DRONE = """<body name="drone" pos="0 0 0"><freejoint/><geom name="hull" size=".01"/>
<camera name="front" xyaxes="0 -1 0 0 0 1" fovy="60"/></body>"""
_KINDS = ("sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh", "hfield")


def make_scene(body: str, assets: str = "", more: str = "") -> Scene:
    """Return a scene of MJCF elements, with a drone at the end."""
    xml = f"""<mujoco><statistic extent="1"/><visual><map znear=".01" zfar="60"/>{more}</visual>
    <asset>{assets}</asset><worldbody>{body}{DRONE}</worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(xml)
    classes = [SemanticClass.OBSTACLE] * (model.ngeom - 1) + [SemanticClass.DRONE]
    return Scene(model, tuple(classes), (-1,) * model.ngeom, (0.2, 0.3, 0.4))


def random_scene(seed: int, count: int = 30) -> Scene:
    """Return a scene of a plane and random geoms of all kinds within 10 m."""
    random = np.random.RandomState(seed)
    heights = " ".join(f"{z:.3f}" for z in random.uniform(0, 1, 9 * 12))
    assets = f"""<mesh name="m" builtin="supersphere" params="24 .6 1.4" scale=".5 .8 .6"/>
    <hfield name="h" nrow="9" ncol="12" size="1.5 1 .6 .3" elevation="{heights}"/>"""
    geoms = ['<geom type="plane" size="9 0 1" pos="0 0 -2"/>']
    for number in range(count):
        kind = _KINDS[number % len(_KINDS)]
        size = " ".join(f"{v:.3f}" for v in random.uniform(0.2, 0.8, 3))
        shape = {"mesh": 'mesh="m"', "hfield": 'hfield="h"'}.get(kind, f'size="{size}"')
        place = " ".join(f"{v:.3f}" for v in random.uniform(-5, 5, 3))
        turn = " ".join(f"{v:.3f}" for v in random.normal(size=4))
        geoms.append(f'<geom type="{kind}" {shape} pos="{place}" quat="{turn}"/>')
    return make_scene("".join(geoms), assets)


def mujoco_rays(scene: Scene, origin: np.ndarray, rays: np.ndarray) -> tuple[Any, Any]:
    """Return geoms, -1 for none, and distances that MuJoCo finds along rays; not the drone."""
    model, data = scene.model, mujoco.MjData(scene.model)
    mujoco.mj_forward(model, data)
    count, drone = len(rays), model.body("drone").id
    geoms, distances = np.zeros(count, np.int32), np.zeros(count)
    mujoco.mj_multiRay(
        model, data, origin, rays.ravel(), None, 1, drone, geoms, distances, None, count, 1e10
    )
    return geoms, distances


def _world(scene: Scene) -> Any:
    start_warp("cpu")
    world = SceneRaytracer(scene, num_envs=1).make_world()
    poses: Any = cast_kernel.PoseArrays()
    frames = 2 + max(scene.props, default=-1) + 1
    poses.positions = wp.zeros((1, frames), dtype=wp.vec3, device="cpu")
    poses.attitudes = wp.array([[1.0, 0.0, 0.0, 0.0]], dtype=wp.vec4, device="cpu")
    world.poses = poses
    return world


def cast(scene: Scene, origin: np.ndarray, rays: np.ndarray) -> Any:
    """Return a structured array of the hits of rays from a point; the drone is not shown."""
    given: Any = wp.array(rays, dtype=wp.vec3, device="cpu")
    kind: Any = cast_kernel.Hit
    hits: Any = wp.zeros(len(rays), dtype=kind, device="cpu")
    inputs = [_world(scene), wp.vec3(*map(float, origin)), given, hits]
    wp.launch(rays_kernel.cast_rays, len(rays), inputs=inputs, device="cpu")
    return hits.numpy()


def are_blocked(scene: Scene, origin: np.ndarray, rays: np.ndarray, distances: Any) -> Any:
    """Return whether a geom is on each ray from a point within a distance."""
    world, kernel = _world(scene), shadows_kernel
    count, shadows = len(world.geoms.kind), kernel.Shadows()
    seen: Any = structs_kernel.GeomView
    light: Any = light_kernel.PlacedLight()
    light.kind = light_kernel.POINT
    arrays = {
        "geoms": (count, seen),
        "boxes": (6 * count, float),
        "points": (12 * 64, float),
        "blocked": (16 * 64, int),
        "is_known": (16, int),
        "meshes": (count, int),
    }
    for name, (size, kind) in arrays.items():
        setattr(shadows, name, wp.zeros(size, dtype=kind, device="cpu"))
    place = wp.vec3(*map(float, origin))
    ends: Any = wp.array(
        origin + rays * np.asarray(distances)[:, None], dtype=wp.vec3, device="cpu"
    )
    lights: Any = wp.array([light], dtype=light_kernel.PlacedLight, device="cpu")
    blocked: Any = wp.zeros(len(rays), dtype=int, device="cpu")
    inputs = [world, shadows, place, ends, lights, blocked]
    wp.launch(rays_kernel.block_rays, 1, inputs=inputs, device="cpu")
    return blocked.numpy() == 1
