# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled bindings are untyped.)
"""Images of the ray tracer compared with MuJoCo's OpenGL renderer, in random scenes.

Run as a program (`python -m benchmarks.render_truth SCENES`) with MUJOCO_GL=egl, because MuJoCo
chooses OpenGL's platform when it is imported.
"""

import dataclasses
import json
import os
import subprocess
import sys
from collections.abc import Iterable
from typing import Any

import mujoco
import numpy as np
import torch
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from benchmarks.benchmark import Setup
from benchmarks.random_scenes import CAMERA, NEAR, NUDGED, SLICES, RandomScenes
from drone_rl.sim.rendering import Poses, Raytracer, Scene, View
from drone_rl.utils.errors import InputError

SIZE = 128
"""Width and height of images in pixels."""
LARGE = 30
"""Overlap is computed for geoms with more pixels than this."""
ENOUGH = 0.98
"""Required overlap of a geom in both images."""
_CREASE = 0.9
"""Cosine of the angle between the normals of neighbouring pixels below which they have a crease."""
_SNAP = 1 / 256
"""Resolution of the positions of corners in OpenGL, pixels."""
_DISABLED = ("SHADOW", "REFLECTION", "SKYBOX", "FOG", "HAZE")
_MODALITIES = ("rgb", "depth", "segmentation", "normals")

Images = dict[str, NDArray[Any]]
"""Images of a scene by modality. Shapes: (height, width, *)."""


@dataclasses.dataclass(frozen=True)
class Difference:
    """Difference between the images of two renderers."""

    inner_wrong: int
    """Number of pixels away from edges that show different geoms."""
    overlaps: tuple[float, ...]
    """Intersection over union of the pixels of each large geom, without pixels in which the result
    depends on OpenGL's rounding."""
    depth_m: float
    """Largest depth difference away from edges that OpenGL's rounding does not explain, metres."""
    rgb: int
    """Largest color difference within a face, levels of 255."""


def compare(ours: Images, theirs: Images) -> Difference:
    """Compare the images of two renderers.

    OpenGL stores a depth d between the near plane n and the far plane f as n (f - d) / (d (f - n))
    in float32, and MuJoCo computes d from it in float32. Each of the two roundings is at most 2^-24
    and is amplified by d^2 / n. OpenGL also moves corners by up to half of `_SNAP`, which changes
    depth by its slope. It renders round solids as facets, see `facet_errors`.

    Args:
        ours: Images of all `_MODALITIES`; "facets", the result of `facet_errors`; "nudged",
            segmentations by cameras that are rotated by `_SNAP`, shape (4, height, width).
        theirs: Images of the same modalities without normals.
    """
    segmentation, reference = ours["segmentation"], theirs["segmentation"]
    visible = (ours["depth"] == 0) | (ours["depth"] >= NEAR)
    inner = ~_edges(segmentation) & ~_edges(reference) & visible
    geoms = [g for g in np.unique(np.stack([segmentation, reference])) if g >= 0]
    large = [g for g in geoms if max((segmentation == g).sum(), (reference == g).sum()) > LARGE]
    stable = visible & (ours["nudged"] == segmentation).all(0)
    both = inner & (segmentation == reference) & (segmentation >= 0)
    depth, smooth = ours["depth"].astype(float), both & ~_creases(ours["normals"])
    explained = 2 * 2.0**-24 * depth**2 / NEAR + _SNAP * _slope(depth) + ours["facets"]
    beyond = np.abs(depth - theirs["depth"]) - explained
    colors = np.abs(ours["rgb"].astype(int) - theirs["rgb"]).max(-1)
    return Difference(
        inner_wrong=int((inner & (segmentation != reference)).sum()),
        overlaps=tuple(_overlap(segmentation == g, reference == g, stable) for g in large),
        depth_m=float(beyond[both].max(initial=0.0)),
        rgb=int(colors[smooth].max(initial=0)),
    )


class OpenGL:
    """MuJoCo's OpenGL renderer without shadows and other effects."""

    def __init__(self, model: mujoco.MjModel) -> None:
        """Create the renderer; the sizes of the model's planes must not change afterwards."""
        self._renderer = mujoco.Renderer(model, SIZE, SIZE)

    def render(self, model: mujoco.MjModel) -> Images:
        """Return RGB, depth and segmentation images."""
        data, renderer = mujoco.MjData(model), self._renderer
        mujoco.mj_forward(model, data)
        renderer.update_scene(data, camera=CAMERA)
        for name in _DISABLED:
            renderer.scene.flags[getattr(mujoco.mjtRndFlag, f"mjRND_{name}")] = 0
        rgb = renderer.render().copy()
        renderer.enable_depth_rendering()
        depth = renderer.render().copy()
        renderer.disable_depth_rendering()
        renderer.enable_segmentation_rendering()
        segmentation = renderer.render()[..., 0].copy()
        renderer.disable_segmentation_rendering()
        return {"rgb": rgb, "depth": depth, "segmentation": segmentation}

    def close(self) -> None:
        """Release the OpenGL context."""
        self._renderer.close()


def render(scene: Scene) -> Images:
    """Return the ray tracer's images with "facets" and "nudged", see `compare`."""
    renderer = Raytracer(scene, num_envs=1, num_shards=1)
    cameras = (CAMERA, *NUDGED)
    view = View(cameras=cameras, height=SIZE, width=SIZE, modalities=_MODALITIES)
    still = Poses(torch.zeros(1, 3), torch.tensor([[1.0, 0.0, 0.0, 0.0]]), torch.zeros(1, 0, 3))
    batch = renderer.render(view, still)
    renderer.close()
    images: Images = {modality: values[0, 0].numpy() for modality, values in batch.items()}
    images["facets"] = facet_errors(scene, images)
    return {**images, "nudged": batch["segmentation"][0, 1:].numpy()}


def facet_errors(scene: Scene, ours: Images) -> NDArray[Any]:
    """Return the error of OpenGL's depth that its facets cause.

    OpenGL divides a round solid of radius r into `SLICES` slices of 2 pi / SLICES and as many
    stacks of pi / SLICES. A facet lies below the surface by the sagittas of both, at most
    s = r (2 - cos(pi / SLICES) - cos(pi / (2 SLICES))): 0.06 mm for r = 1.5 m. If a ray meets the
    surface at an angle with cosine c to the normal, its length is up to s / c too large. Measured
    for a sphere of 1.36 m at c = 0.05: OpenGL differs by 0.76 mm, and the ray tracer by 0.001 mm
    from the depth in float64.

    Args:
        scene: A scene in which the camera `CAMERA` is fixed to the world.
        ours: "depth", "segmentation" and "normals" of the ray tracer.

    Returns:
        Largest error along the camera's axis, metres, for pixels of geoms. Shape: (height, width).
    """
    model, camera = scene.model, scene.camera(CAMERA)
    half = np.tan(np.radians(model.cam_fovy[camera]) / 2)
    at = ((np.arange(SIZE) + 0.5) / SIZE * 2 - 1) * half
    rays = np.stack(np.broadcast_arrays(at[None, :], -at[:, None], -1.0), -1)
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, model.cam_quat[camera])
    rays = rays @ turn.reshape(3, 3).T
    cosines = -(rays * ours["normals"]).sum(-1) / np.linalg.norm(rays, axis=-1)
    kinds, sizes = model.geom_type, model.geom_size
    is_flat = (kinds == mujoco.mjtGeom.mjGEOM_PLANE) | (kinds == mujoco.mjtGeom.mjGEOM_BOX)
    is_ellipsoid = kinds == mujoco.mjtGeom.mjGEOM_ELLIPSOID
    radii = np.where(is_flat, 0.0, np.where(is_ellipsoid, sizes.max(1), sizes[:, 0]))
    sagittas = radii * (2 - np.cos(np.pi / SLICES) - np.cos(np.pi / (2 * SLICES)))
    return sagittas[ours["segmentation"]] / np.maximum(cosines, 1e-6)


def compare_scenes(count: int, seed: int = 0) -> list[Difference]:
    """Compare the renderers in random scenes; requires MUJOCO_GL=egl."""
    scenes = RandomScenes(seed, nudge=_SNAP / SIZE)
    opengl = OpenGL(scenes.model)
    try:
        sampled = (scenes.sample() for _ in range(count))
        return [compare(render(scene), opengl.render(scene.model)) for scene in sampled]
    finally:
        opengl.close()


def summary(differences: Iterable[Difference]) -> dict[str, Any]:
    """Return the figures of all scenes, by key."""
    every = list(differences)
    overlaps = [overlap for c in every for overlap in c.overlaps]
    return {
        "render_truth_scenes": len(every),
        "render_truth_inner_wrong": sum(c.inner_wrong for c in every),
        "render_truth_geoms": len(overlaps),
        "render_truth_overlapping": sum(overlap >= ENOUGH for overlap in overlaps),
        "render_truth_least_overlap": min(overlaps),
        "render_truth_depth_mm": 1000 * max(c.depth_m for c in every),
        "render_truth_rgb": max(c.rgb for c in every),
    }


def bench_render_truth(setup: Setup) -> dict[str, Any]:
    """Compare the renderers in 1,000 random scenes, 50 if quick.

    Raises:
        InputError: OpenGL is not available; an empty result could pass for a measurement.
    """
    command = [sys.executable, "-m", "benchmarks.render_truth", "50" if setup.quick else "1000"]
    environment = {**os.environ, "MUJOCO_GL": "egl"}
    process = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    if process.returncode != 0:
        reason = (process.stderr.strip().splitlines() or [f"exit status {process.returncode}"])[-1]
        raise InputError(
            f"render_truth needs OpenGL by EGL, which failed ({reason[:200]}); install a driver "
            "such as libegl-mesa0"
        )
    return json.loads(process.stdout.strip().splitlines()[-1])


def _windows(values: NDArray[Any]) -> NDArray[Any]:
    """Return the 3x3 neighbourhood of each pixel. Shape: (height, width, *, 3, 3)."""
    around = [(1, 1), (1, 1), *[(0, 0)] * (values.ndim - 2)]
    return sliding_window_view(np.pad(values, around, mode="edge"), (3, 3), axis=(0, 1))


def _edges(segmentation: NDArray[Any]) -> NDArray[np.bool_]:
    """Return whether the neighbourhood of each pixel shows more than one geom."""
    return (_windows(segmentation) != segmentation[..., None, None]).any((-2, -1))


def _creases(normals: NDArray[Any]) -> NDArray[np.bool_]:
    """Return whether the neighbourhood of each pixel has a crease."""
    cosines = (_windows(normals) * normals[..., None, None]).sum(2)
    return (cosines < _CREASE).any((-2, -1))


def _slope(depth: NDArray[Any]) -> NDArray[Any]:
    """Return the largest change of depth to a neighbouring pixel."""
    return np.abs(_windows(depth) - depth[..., None, None]).max((-2, -1))


def _overlap(ours: NDArray[Any], theirs: NDArray[Any], stable: NDArray[Any]) -> float:
    either = ((ours | theirs) & stable).sum()
    return float((ours & theirs & stable).sum() / either) if either else 1.0


if __name__ == "__main__":
    sys.stdout.write(json.dumps(summary(compare_scenes(int(sys.argv[1])))) + "\n")
