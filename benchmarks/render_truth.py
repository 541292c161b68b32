# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled bindings are untyped.)
"""Our pictures against MuJoCo's own by OpenGL, of scenes that nobody has arranged.

Run as a program (`python -m benchmarks.render_truth SCENES`) with MUJOCO_GL=egl, since OpenGL's
platform is chosen when MuJoCo is imported.
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

from benchmarks.random_scenes import CAMERA, NEAR, NUDGED, SLICES, RandomScenes
from drone_rl.sim.rendering import Poses, Raytracer, Scene, View
from drone_rl.utils.errors import InputError

SIZE = 128
"""Pixels across and down."""
LARGE = 30
"""Pixels of a geom, more than which its overlap is told."""
ENOUGH = 0.98
"""Overlap of a geom in both pictures."""
_CREASE = 0.9
"""Cosine of the angle between neighbouring normals below which an edge of a solid lies between."""
_SNAP = 1 / 256
"""Pixels to which OpenGL rounds where corners are."""
_PLAIN = ("SHADOW", "REFLECTION", "SKYBOX", "FOG", "HAZE")
_MODALITIES = ("rgb", "depth", "segmentation", "normals")

Picture = dict[str, NDArray[Any]]
"""What a scene shows, by modality. Shapes: (height, width, *)."""


@dataclasses.dataclass(frozen=True)
class Compared:
    """How two pictures of a scene differ."""

    inner_wrong: int
    """Pixels on no edge in which another geom is seen."""
    overlaps: tuple[float, ...]
    """Of each geom that is large in one of them: pixels in both over pixels in any, but for those
    in which OpenGL's own rounding decides what is seen."""
    depth_m: float
    """Greatest difference on no edge beyond what OpenGL's own rounding explains."""
    rgb: int
    """Greatest difference of a colour within a face, levels of 255."""


def compare(ours: Picture, theirs: Picture) -> Compared:
    """Compares two pictures of a scene.

    OpenGL keeps n (f - d) / (d (f - n)) of a depth d between the ends n and f of what it draws, in
    float32, out of which MuJoCo computes d, in float32 again: two roundings by 2^-24 at most, each
    of which is d^2 / n times as large in d. It also moves corners by up to half of `_SNAP`, and so
    surfaces by as much as their depth changes over that.

    It also renders round solids as facets, see `facet_errors`.

    Args:
        ours: All of `_MODALITIES`; as "facets" what `facet_errors` returns; and as "nudged"
            segmentations by cameras that are turned by `_SNAP`, shape (4, height, width).
        theirs: The same without normals.
    """
    seen, other = ours["segmentation"], theirs["segmentation"]
    drawn = (ours["depth"] == 0) | (ours["depth"] >= NEAR)
    inner = ~_edges(seen) & ~_edges(other) & drawn
    geoms = [g for g in np.unique(np.stack([seen, other])) if g >= 0]
    large = [g for g in geoms if max((seen == g).sum(), (other == g).sum()) > LARGE]
    sure = drawn & (ours["nudged"] == seen).all(0)
    both = inner & (seen == other) & (seen >= 0)
    depth, smooth = ours["depth"].astype(float), both & ~_creases(ours["normals"])
    explained = 2 * 2.0**-24 * depth**2 / NEAR + _SNAP * _slope(depth) + ours["facets"]
    beyond = np.abs(depth - theirs["depth"]) - explained
    colors = np.abs(ours["rgb"].astype(int) - theirs["rgb"]).max(-1)
    return Compared(
        inner_wrong=int((inner & (seen != other)).sum()),
        overlaps=tuple(_overlap(seen == g, other == g, sure) for g in large),
        depth_m=float(beyond[both].max(initial=0.0)),
        rgb=int(colors[smooth].max(initial=0)),
    )


class OpenGL:
    """MuJoCo's own renderer, without shadows and the like."""

    def __init__(self, model: mujoco.MjModel) -> None:
        """Starts it; the model may be changed later, but for its planes."""
        self._renderer = mujoco.Renderer(model, SIZE, SIZE)

    def draw(self, model: mujoco.MjModel) -> Picture:
        """Colours, depth and segmentation."""
        data, renderer = mujoco.MjData(model), self._renderer
        mujoco.mj_forward(model, data)
        renderer.update_scene(data, camera=CAMERA)
        for name in _PLAIN:
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
        """Ends it."""
        self._renderer.close()


def draw(scene: Scene) -> Picture:
    """The same by our own renderer, and what `compare` needs besides."""
    renderer = Raytracer(scene, num_worlds=1, num_shards=1)
    cameras = (CAMERA, *NUDGED)
    view = View(cameras=cameras, height=SIZE, width=SIZE, modalities=_MODALITIES)
    still = Poses(torch.zeros(1, 3), torch.tensor([[1.0, 0.0, 0.0, 0.0]]), torch.zeros(1, 0, 3))
    pictures = renderer.render(view, still)
    renderer.close()
    drawn: Picture = {modality: several[0, 0].numpy() for modality, several in pictures.items()}
    drawn["facets"] = facet_errors(scene, drawn)
    return {**drawn, "nudged": pictures["segmentation"][0, 1:].numpy()}


def facet_errors(scene: Scene, ours: Picture) -> NDArray[Any]:
    """Return the error of OpenGL's depth that follows from its facets.

    OpenGL divides a round solid of radius r into `SLICES` slices of 2 pi / SLICES and as many
    stacks of pi / SLICES. A facet lies below the surface by the sagittas of both, at most
    s = r (2 - cos(pi / SLICES) - cos(pi / (2 SLICES))): 0.06 mm for r = 1.5 m. A ray that meets the
    surface at an angle with cosine c to the normal therefore goes up to s / c too far. Measured: a
    ball of 1.36 m at c = 0.05 differs by 0.76 mm, while our depth differs by 0.001 mm from that
    computed in float64.

    Args:
        scene: Whose camera `CAMERA` is fixed to the world.
        ours: "depth", "segmentation" and "normals" of its image.

    Returns:
        Metres along the camera's axis, where a geom is seen. Shape: (height, width).
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


def compare_scenes(count: int, seed: int = 0) -> list[Compared]:
    """Compares so many random scenes; needs MUJOCO_GL=egl."""
    scenes = RandomScenes(seed, nudge=_SNAP / SIZE)
    opengl = OpenGL(scenes.model)
    try:
        drawn = (scenes.draw() for _ in range(count))
        return [compare(draw(scene), opengl.draw(scene.model)) for scene in drawn]
    finally:
        opengl.close()


def summary(compared: Iterable[Compared]) -> dict[str, Any]:
    """Figures over scenes, by their names in results.json."""
    every = list(compared)
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


def bench_render_truth(quick: bool) -> dict[str, Any]:
    """Figures of 1,000 scenes, 50 if quick.

    Raises:
        InputError: They can't be rendered by OpenGL here. No figures would look like a measurement.
    """
    command = [sys.executable, "-m", "benchmarks.render_truth", "50" if quick else "1000"]
    environment = {**os.environ, "MUJOCO_GL": "egl"}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    if done.returncode != 0:
        reason = (done.stderr.strip().splitlines() or [f"exit status {done.returncode}"])[-1]
        raise InputError(
            f"render_truth needs OpenGL by EGL, which failed ({reason[:200]}); install a driver "
            "such as libegl-mesa0"
        )
    return json.loads(done.stdout.strip().splitlines()[-1])


def _windows(values: NDArray[Any]) -> NDArray[Any]:
    """Of each pixel the 3x3 pixels around it. Shape: (height, width, *, 3, 3)."""
    around = [(1, 1), (1, 1), *[(0, 0)] * (values.ndim - 2)]
    return sliding_window_view(np.pad(values, around, mode="edge"), (3, 3), axis=(0, 1))


def _edges(segmentation: NDArray[Any]) -> NDArray[np.bool_]:
    """Pixels around which not everything is one geom."""
    return (_windows(segmentation) != segmentation[..., None, None]).any((-2, -1))


def _creases(normals: NDArray[Any]) -> NDArray[np.bool_]:
    """Pixels around which a surface is bent sharply."""
    cosines = (_windows(normals) * normals[..., None, None]).sum(2)
    return (cosines < _CREASE).any((-2, -1))


def _slope(depth: NDArray[Any]) -> NDArray[Any]:
    """How much depth changes from pixel to pixel, at most."""
    return np.abs(_windows(depth) - depth[..., None, None]).max((-2, -1))


def _overlap(ours: NDArray[Any], theirs: NDArray[Any], sure: NDArray[Any]) -> float:
    either = ((ours | theirs) & sure).sum()
    return float((ours & theirs & sure).sum() / either) if either else 1.0


if __name__ == "__main__":
    sys.stdout.write(json.dumps(summary(compare_scenes(int(sys.argv[1])))) + "\n")
