"""The renderer `raytrace`, by kind of scene: solids under distant lights, or any geoms and lights.

`SceneRaytracer` renders the others on a CPU: meshes, height fields, and lights of all kinds.
"""

from typing import Any

import numpy as np
import torch
import warp as wp
from torch import Tensor

from drone_rl.sim.rendering.appearance import Appearance
from drone_rl.sim.rendering.devices import WorkerPool, load_kernels, start_warp
from drone_rl.sim.rendering.raytrace import scene as scenes
from drone_rl.sim.rendering.raytrace import structs_kernel as structs
from drone_rl.sim.rendering.raytrace import tiles_kernel
from drone_rl.sim.rendering.raytrace.canvas_kernel import TILE
from drone_rl.sim.rendering.raytrace.cast_kernel import MESH, World
from drone_rl.sim.rendering.raytrace.light import LookEncoder
from drone_rl.sim.rendering.raytrace.light_kernel import MOST_LIGHTS
from drone_rl.sim.rendering.raytrace.renderer import MODALITY_BITS, Raytracer, as_images
from drone_rl.sim.rendering.raytrace.triangles import make_triangles, read_height_field, read_mesh
from drone_rl.sim.rendering.renderer import Poses, Renderer
from drone_rl.sim.rendering.scene import Scene
from drone_rl.sim.rendering.view import Modality, View
from drone_rl.utils.errors import InputError


def make_raytracer(
    scene: Scene, *, num_envs: int, num_shards: int | None = None, device: str = "cpu"
) -> Renderer:
    """Return the ray tracer that renders a scene; see `RendererFactory`."""
    reason = scenes.why_not_simple(scene)
    if reason is None:
        return Raytracer(scene, num_envs=num_envs, num_shards=num_shards, device=device)
    if device != "cpu":
        raise InputError(
            f"{reason}, which renderer=raytrace renders on a CPU alone; give device=cpu or "
            "renderer=mujoco_warp"
        )
    return SceneRaytracer(scene, num_envs=num_envs, num_shards=num_shards)


class SceneRaytracer:
    """Renders scenes of any geoms and lights, on a CPU."""

    def __init__(self, scene: Scene, *, num_envs: int, num_shards: int | None = None) -> None:
        """Prepare a scene; see `RendererFactory`. The first image loads the kernels."""
        start_warp("cpu")
        self.scene, self.device = scene, torch.device("cpu")
        self._workers = WorkerPool(num_envs, num_shards)
        self._frames = scenes.Frames(scene)
        self._looks = LookEncoder(scene, self._frames, self._workers.size)
        self._triangles, self._mesh_of_geom = _read_triangles(scene)
        self._views: dict[View, tuple[scenes.Cameras, Any, Any]] = {}
        self._poses = scenes.PoseBuffers(self.device)

    def prepare(self, view: View) -> None:
        """Build the kernels' structs of a view; see `Renderer.prepare`."""
        if view in self._views:
            return
        view.check_modalities(self, MODALITY_BITS)
        encoded = scenes.make_view(self.scene, self._frames, view, "cpu")
        encoded.what = sum({MODALITY_BITS[modality] for modality in view.modalities})
        world = self.make_world(view.show_drone)
        scratch = _make_scratch(view, self._workers.size, len(world.geoms.kind))
        self._views[view] = scenes.Cameras(view, encoded, self.device), world, scratch

    def render(
        self, view: View, poses: Poses, appearance: Appearance | None = None
    ) -> dict[Modality, Tensor]:
        """Render environments; see `Renderer.render`."""
        self.prepare(view)
        cameras, world, scratch = self._views[view]
        look = appearance or Appearance()
        encoded = cameras.encode(look.camera, len(poses))
        world.poses = self._poses.write(poses, look.distractors)
        images = view.new_images(len(poses))
        shown = self._looks.encode(appearance, len(poses))
        inputs = [encoded, world, shown, scratch, as_images(images)]
        load_kernels(tiles_kernel).result()

        def work(worker: int, first: int, last: int) -> None:
            given = [first, last, worker, *inputs]
            wp.launch(tiles_kernel.render_tiles, 1, inputs=given, device="cpu")

        self._workers.map_spans(0, len(poses) * len(view.cameras), work)
        return images

    def make_world(self, show_drone: bool = False) -> Any:
        """Return the scene's geoms for the kernels, a `World` without poses."""
        world: Any = World()
        world.geoms = scenes.make_geoms(self.scene, self._frames, show_drone, "cpu")
        numbers: Any = world.geoms.number.numpy()
        world.mesh = wp.array(self._mesh_of_geom[numbers], dtype=int, device="cpu")
        world.triangles = self._triangles
        return world

    def close(self) -> None:
        """Stop the threads."""
        self._workers.close()


def _read_triangles(scene: Scene) -> tuple[Any, np.ndarray]:
    """Return all that is made of triangles, and which of it each geom of the model is, or -1."""
    model, kinds = scene.model, scenes.mujoco.mjtGeom
    of_geom = np.full(model.ngeom, -1)
    known: dict[tuple[bool, int], int] = {}
    for geom in scene.shown(True):
        if scenes.kind_of(model, geom) == MESH:
            is_field = model.geom_type[geom] == kinds.mjGEOM_HFIELD
            of_geom[geom] = known.setdefault((is_field, int(model.geom_dataid[geom])), len(known))
    meshes = [
        (read_height_field if is_field else read_mesh)(model, number) for is_field, number in known
    ]
    return make_triangles(meshes), of_geom


def _make_scratch(view: View, workers: int, geoms: int) -> Any:
    across, down = -(-view.width // TILE), -(-view.height // TILE)
    tiles = across * down
    kind: Any = structs.GeomView
    surface: Any = tiles_kernel.Surface
    arrays = {
        "depth": (tiles * TILE**2, float),
        "owner": (tiles * TILE**2, int),
        "part": (tiles * TILE**2, int),
        "farthest": (tiles, float),
        "is_old": (tiles, int),
        "geoms": (geoms, kind),
        "order": (geoms, int),
        "least": (geoms, float),
        "parts": (geoms, wp.vec4i),
        "faces": (2, surface),
        "boxes": (6 * geoms, float),
        "points": (2 * 6 * TILE**2, float),
        "blocked": (2 * int(MOST_LIGHTS) * TILE**2, int),
        "is_known": (2 * int(MOST_LIGHTS), int),
        "colors": (TILE**2, wp.vec3),
        "is_shown": (TILE**2, int),
        "pixels": (view.width * view.height, wp.vec3ub),
    }
    scratch: Any = tiles_kernel.TileScratch()
    for name, (length, dtype) in arrays.items():
        setattr(scratch, name, wp.empty((workers, length), dtype=dtype, device="cpu"))
    return scratch
