"""Images of other people's scene files: the ray tracer's against those of MuJoCo's OpenGL.

Run as a program (`python -m benchmarks.worlds.strangers NUMBER`) with MUJOCO_GL=egl, because MuJoCo
chooses OpenGL's platform when it is imported.
"""

import importlib.util
import itertools
import json
import logging
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import mujoco as _mujoco
import numpy as np
import torch
from numpy.typing import NDArray

from benchmarks.benchmark import Figures, Setup
from drone_rl.sim.rendering import Poses, Scene, View, find_renderer
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.rendering.view import to_gray
from drone_rl.sim.scenes import SceneFile, load_scene
from drone_rl.utils.errors import InputError

_log = logging.getLogger(__name__)
mujoco: Any = _mujoco
"""MuJoCo's bindings, which are untyped."""
FOLDERS = (
    "dm_control/suite",
    "dm_control/locomotion",
    "dm_control/third_party",
    "dm_control/mujoco/testing/assets",
    "gymnasium/envs/mujoco/assets",
    "mujoco_warp/test_data",
    "mujoco/testdata",
)
"""Where files are looked for, in the folder of installed packages."""
SIZE = 256
"""Pixels of an image, each way."""
NEAR = 8.0
"""Levels of 255 by which gray may differ."""
LARGEST_SEGMENTATION_ERROR = 0.01
LEAST_GRAY = 0.95
VIEWS = (("whole", 0.0, 1.5), ("close", 130.0, 0.8))
"""Cameras: name, turn to the left of the file's own free camera in degrees, distance in extents."""


class Likeness(NamedTuple):
    """How similar the images of a file are, on pixels whose neighbours agree."""

    file: str
    segmentation: float
    """Fraction of pixels whose geom differs."""
    gray: float
    """Fraction of pixels whose gray is within `NEAR`."""

    @property
    def is_right(self) -> bool:
        """Whether both are good enough."""
        return self.segmentation <= LARGEST_SEGMENTATION_ERROR and self.gray >= LEAST_GRAY


def bench_strangers(setup: Setup) -> Figures:
    """Compare the files of installed packages, 6 if quick, from two cameras each.

    Returns:
        "world_strangers": number of files; "world_strangers_right": fraction of them whose images
        are those of OpenGL (None without OpenGL); "world_strangers_geoms", "world_strangers_gray":
        fractions of the pixels, with neighbours of the same geom, that show another geom, and whose
        gray is within 8 of 255; "world_strangers_worst": the files that differ most.
    """
    process = subprocess.run(
        [sys.executable, "-m", "benchmarks.worlds.strangers", "6" if setup.quick else "1000"],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "MUJOCO_GL": "egl"},
        check=True,
    )
    return json.loads(process.stdout.splitlines()[-1])


def measure(most: int) -> Figures:
    """Return the figures of `bench_strangers`, of at most some files."""
    if not has_opengl():
        _log.warning("MuJoCo's OpenGL is missing: install EGL (libegl1)")
        return {"world_strangers": 0, "world_strangers_right": None}
    found: list[Likeness] = []
    for path in itertools.takewhile(lambda _: len(found) < most, files()):
        try:
            found.append(compare(load_scene(path)))
        except InputError as error:
            _log.info("left out: %s", error)
    worst = sorted(found, key=lambda one: one.gray)[:8]
    return {
        "world_strangers": len(found),
        "world_strangers_right": float(np.mean([one.is_right for one in found])),
        "world_strangers_geoms": float(np.mean([one.segmentation for one in found])),
        "world_strangers_gray": float(np.mean([one.gray for one in found])),
        "world_strangers_worst": {one.file: one[1:] for one in worst},
    }


def files() -> Iterator[Path]:
    """Yield MJCF files of installed packages, also those that are only parts of others."""
    root = Path(str(importlib.util.find_spec("mujoco").origin)).parents[1]  # type: ignore[union-attr]
    for folder in FOLDERS:
        yield from sorted((root / folder).rglob("*.xml"))


def has_opengl() -> bool:
    """Return whether MuJoCo can render with OpenGL."""
    try:
        mujoco.Renderer(mujoco.MjModel.from_xml_string("<mujoco/>"), 8, 8).close()
    except Exception:  # whatever a missing library raises
        return False
    return True


def compare(file: SceneFile) -> Likeness:
    """Render a file from both cameras with both renderers."""
    scene = with_cameras(file)
    ours = render_ours(scene)
    theirs = render_opengl(scene)
    differs, near = [], []
    for name, _, _ in VIEWS:
        is_inner = inner(theirs[name][1])
        differs.append((ours[name][1] != theirs[name][1])[is_inner])
        grays = [to_gray(torch.from_numpy(images[name][0])) for images in (ours, theirs)]
        near.append(((grays[0] - grays[1]).abs() * 255 <= NEAR).numpy()[is_inner])
    return Likeness(
        str(file.path).rpartition("site-packages/")[2],
        float(np.concatenate(differs).mean()),
        float(np.concatenate(near).mean()),
    )


def with_cameras(file: SceneFile) -> Scene:
    """Return a scene file as a scene that never moves, seen by `VIEWS`."""
    spec = mujoco.MjSpec.from_string(file.mjcf, assets=dict(file.assets))
    center, extent = file.model.stat.center, file.model.stat.extent
    view = file.model.vis.global_
    for name, turn, distance in VIEWS:
        across, up = np.radians(view.azimuth + turn), np.radians(view.elevation)
        back = -np.array([np.cos(up) * np.cos(across), np.cos(up) * np.sin(across), np.sin(up)])
        right = np.array([np.sin(across), -np.cos(across), 0.0])
        axes = np.stack([right, np.cross(back, right), back], 1)
        turned = np.empty(4)
        mujoco.mju_mat2Quat(turned, axes.reshape(-1))
        place = center + back * distance * extent
        spec.worldbody.add_camera(name=name, pos=place, quat=turned, fovy=view.fovy)
    model = spec.compile()
    model.stat.center[:], model.stat.extent = center, extent
    count = model.ngeom
    return Scene(model, (SemanticClass.GROUND,) * count, (-1,) * count, (0.0, 0.0, 0.0))


Images = dict[str, tuple[NDArray[np.uint8], NDArray[np.int32]]]
"""By camera: colors, (SIZE, SIZE, 3), and the index of the geom that each pixel shows."""


def render_ours(scene: Scene) -> Images:
    """Render both cameras with the ray tracer."""
    renderer = find_renderer("raytrace")(scene, num_envs=1, num_shards=None, device="cpu")
    names = tuple(name for name, _, _ in VIEWS)
    view = View(cameras=names, height=SIZE, width=SIZE, modalities=("rgb", "segmentation"))
    poses = Poses(torch.zeros(1, 3), torch.tensor([[1.0, 0, 0, 0]]), torch.zeros(1, 0, 3))
    images = {name: values[0].numpy() for name, values in renderer.render(view, poses).items()}
    renderer.close()
    return {name: (images["rgb"][i], images["segmentation"][i]) for i, name in enumerate(names)}


def render_opengl(scene: Scene) -> Images:
    """Render both cameras with OpenGL, without what the ray tracer does not render."""
    model, data = scene.model, mujoco.MjData(scene.model)
    mujoco.mj_forward(model, data)
    model.vis.global_.offwidth = model.vis.global_.offheight = SIZE
    model.vis.quality.offsamples = 0
    options = mujoco.MjvOption()
    options.sitegroup[:] = 0
    images: Images = {}
    with mujoco.Renderer(model, SIZE, SIZE, max_geom=20_000) as renderer:
        for name, _, _ in VIEWS:
            renderer.disable_segmentation_rendering()
            renderer.update_scene(data, name, options)
            for flag in ("REFLECTION", "HAZE", "FOG"):
                renderer.scene.flags[getattr(mujoco.mjtRndFlag, f"mjRND_{flag}")] = 0
            color = renderer.render().copy()
            renderer.enable_segmentation_rendering()
            images[name] = color, renderer.render()[..., 0].copy()
    return images


def inner(segmentation: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Return which pixels have only neighbours, of eight, of the same geom. Not at the edges."""
    result = np.zeros(segmentation.shape, bool)
    middle = segmentation[1:-1, 1:-1]
    result[1:-1, 1:-1] = True
    for row in range(3):
        for column in range(3):
            other = segmentation[row : row + middle.shape[0], column : column + middle.shape[1]]
            result[1:-1, 1:-1] &= other == middle
    return result


if __name__ == "__main__":
    logging.basicConfig(level=logging.INFO, stream=sys.stderr, force=True)
    sys.stdout.write(json.dumps(measure(int(sys.argv[1]))) + "\n")
