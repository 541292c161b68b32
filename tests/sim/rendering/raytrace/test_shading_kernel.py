"""Pixel spans of a face and of the sky; test_renderer_launchers tests whole images."""

import numpy as np
import pytest
import warp as wp

from drone_rl.sim.rendering.raytrace import structs_kernel
from drone_rl.sim.rendering.raytrace.intersection_kernel import BOX
from drone_rl.sim.rendering.raytrace.shading_kernel import shade_span
from tests.box_ahead import array, images, materials, view

KINDS = {
    "rgb": (structs_kernel.RGB, wp.vec3ub),
    "gray": (structs_kernel.GRAY, float),
    "depth": (structs_kernel.DEPTH, float),
    "distance": (structs_kernel.DISTANCE, float),
    "segmentation": (structs_kernel.SEGMENTATION, int),
    "normals": (structs_kernel.NORMALS, wp.vec3),
}


@wp.kernel(enable_backward=False)
def put(job: structs_kernel.Job, material: structs_kernel.Materials, out: structs_kernel.Images):
    shade_span(job, material, out, 2, 5, job.owner[2], job.nearest[2])
    shade_span(job, material, out, 5, 6, job.owner[5], job.nearest[5])


def shown_by(*names):
    """Return images of three pixels of a face along z at 4 to 6 m, and one of the sky."""
    out = images(**{name: dtype for name, (_, dtype) in KINDS.items() if name in names})
    box = structs_kernel.GeomView()
    box.kind, box.number, box.axes = int(BOX), 3, wp.mat33(*np.eye(3).flatten())
    job = structs_kernel.Job()
    job.view = view(sum(int(KINDS[name][0]) for name in names))
    job.rays = wp.zeros(6, dtype=wp.vec3, device="cpu")
    job.nearest = array([1e10, 1e10, 4.0, 5.0, 6.0, 1e10], float)
    job.cosines = array([1.0, 1.0, 0.5, 0.5, 0.5, 0.5], float)
    job.owner = array([-1, -1, 5, 5, 5, -1], int)
    job.geom_views = array([box], structs_kernel.GeomView)
    wp.launch(put, 1, inputs=[job, materials(), out], device="cpu")
    return {name: getattr(out, name).numpy()[0, 2:6].tolist() for name in names}


def test_span_of_geom_and_sky_pixels():
    shown = shown_by(*KINDS)
    assert shown["rgb"] == [[173, 86, 0]] * 3 + [[10, 20, 30]]
    assert shown["distance"] == [4.0, 5.0, 6.0, 0.0]
    assert shown["depth"] == [2.0, 2.5, 3.0, 0.0]
    assert shown["segmentation"] == [3, 3, 3, -1]
    assert shown["normals"] == [[0.0, 0.0, 1.0]] * 3 + [[0.0] * 3]
    assert shown["gray"] == pytest.approx(
        [(0.299 * 173 + 0.587 * 86) / 255] * 3 + [0.0715], abs=1e-3
    )


@pytest.mark.parametrize("name", KINDS)
def test_modalities_are_independent(name):
    assert shown_by(name)[name] == shown_by(*KINDS)[name]
