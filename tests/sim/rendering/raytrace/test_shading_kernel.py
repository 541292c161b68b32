"""Pixels, each by itself and in a row; what light makes of colours is in test_raytrace_painters."""

import numpy as np
import pytest
import warp as wp

from drone_rl.sim.rendering.raytrace import structs_kernel
from drone_rl.sim.rendering.raytrace.shading_kernel import (
    geom_pixel,
    sky_pixel,
    write_pixel,
    write_span,
)
from tests.box_ahead import SIZE, images, materials

KINDS = {
    "rgb": (structs_kernel.RGB, wp.vec3ub),
    "gray": (structs_kernel.GRAY, float),
    "depth": (structs_kernel.DEPTH, float),
    "distance": (structs_kernel.DISTANCE, float),
    "segmentation": (structs_kernel.SEGMENTATION, int),
    "normals": (structs_kernel.NORMALS, wp.vec3),
}


@wp.kernel(enable_backward=False)
def put_singly(
    what: int,
    worn: structs_kernel.Materials,
    out: structs_kernel.Images,
    distances: wp.array[float],
    cosines: wp.array[float],
):
    shown = geom_pixel(worn, 0, 3, wp.vec3(0.0, 0.0, 1.0))
    for pixel in range(2, 5):
        write_pixel(out, what, 0, pixel, shown, distances[pixel], cosines[pixel])
    write_pixel(out, what, 0, 5, sky_pixel(worn, 0), 0.0, cosines[5])


@wp.kernel(enable_backward=False)
def put_together(
    what: int,
    worn: structs_kernel.Materials,
    out: structs_kernel.Images,
    distances: wp.array[float],
    cosines: wp.array[float],
):
    shown = geom_pixel(worn, 0, 3, wp.vec3(0.0, 0.0, 1.0))
    write_span(out, what, 0, 2, 5, shown, distances, cosines)
    write_span(out, what, 0, 5, 6, sky_pixel(worn, 0), distances, cosines)


def put(kernel, *names):
    out = images(**{name: dtype for name, (_, dtype) in KINDS.items() if name in names})
    distances, cosines = np.full(SIZE * SIZE, 1e10), np.ones(SIZE * SIZE)
    distances[2:6], cosines[2:6] = [4.0, 5.0, 6.0, 0.0], 0.5
    given = [wp.array(values, dtype=float, device="cpu") for values in (distances, cosines)]
    what = sum(int(KINDS[name][0]) for name in names)
    wp.launch(kernel, 1, inputs=[what, materials(), out, *given], device="cpu")
    return {name: getattr(out, name).numpy()[0, 2:6].tolist() for name in names}


@pytest.mark.parametrize("kernel", [put_singly, put_together])
def test_three_pixels_of_a_geom_and_one_of_the_sky(kernel):
    shown = put(kernel, *KINDS)
    assert shown["rgb"] == [[173, 86, 0]] * 3 + [[10, 20, 30]]
    assert shown["distance"] == [4.0, 5.0, 6.0, 0.0]
    assert shown["depth"] == [2.0, 2.5, 3.0, 0.0]
    assert shown["segmentation"] == [3, 3, 3, -1]
    assert shown["normals"] == [[0.0, 0.0, 1.0]] * 3 + [[0.0] * 3]
    assert shown["gray"] == pytest.approx(
        [(0.299 * 173 + 0.587 * 86) / 255] * 3 + [0.0715], abs=1e-3
    )


@pytest.mark.parametrize("kernel", [put_singly, put_together])
@pytest.mark.parametrize("name", KINDS)
def test_any_modality_may_be_asked_for_alone(kernel, name):
    assert put(kernel, name)[name] == put(kernel, *KINDS)[name]
