"""Loops over spans of pixels."""

import numpy as np
import pytest
import warp as wp

from drone_rl.sim.rendering.raytrace import spans_kernel


@wp.kernel(enable_backward=False)
def fill(
    floats: wp.array[float],
    ints: wp.array[int],
    colors: wp.array[wp.vec3ub],
    vectors: wp.array[wp.vec3],
):
    spans_kernel.fill(floats, 2, 5, 0.5)
    spans_kernel.fill(ints, 2, 5, 7)
    spans_kernel.fill(colors, 2, 5, wp.vec3ub(wp.uint8(1), wp.uint8(2), wp.uint8(3)))
    spans_kernel.fill(vectors, 2, 5, wp.vec3(1.0, 2.0, 3.0))


@wp.kernel(enable_backward=False)
def combine(
    copied: wp.array[float], product: wp.array[float], given: wp.array[float], by: wp.array[float]
):
    spans_kernel.copy(copied, 1, 3, given)
    spans_kernel.multiply(product, 1, 3, given, by)


@wp.kernel(enable_backward=False)
def level(nearest: wp.array[float], owner: wp.array[int], rays: wp.array[wp.vec3]):
    spans_kernel.intersect_level_plane(
        nearest, owner, 1, 5, rays, wp.vec3(0.0, 1.0, 0.0), -2.0, 1e-6, 9
    )


def array(values, dtype):
    return wp.array(values, dtype=dtype, device="cpu")


@pytest.mark.parametrize(
    ("place", "dtype", "value"),
    [(0, float, 0.5), (1, int, 7), (2, wp.vec3ub, [1, 2, 3]), (3, wp.vec3, [1.0, 2.0, 3.0])],
)
def test_only_the_span_is_filled(place, dtype, value):
    types = (float, int, wp.vec3ub, wp.vec3)
    given = [wp.zeros(8, dtype=kind, device="cpu") for kind in types]
    wp.launch(fill, 1, inputs=given, device="cpu")
    expected = np.zeros_like(given[place].numpy())
    expected[2:5] = value
    assert given[place].numpy().tolist() == expected.tolist()


def test_spans_are_copied_and_multiplied():
    copied, product = (wp.zeros(4, dtype=float, device="cpu") for _ in range(2))
    given, by = array([1.0, 2.0, 3.0, 4.0], float), array([5.0, 6.0, 7.0, 8.0], float)
    wp.launch(combine, 1, inputs=[copied, product, given, by], device="cpu")
    assert copied.numpy().tolist() == [0, 2, 3, 0]
    assert product.numpy().tolist() == [0, 12, 21, 0]


def test_level_plane_replaces_pixels_that_are_not_nearer():
    """From a height of 2 m the distance is 2 m straight down and 4 m at half the slope."""
    nearest = array([1e10, 1e10, 1e10, 3.9, 4.0, 1e10], float)
    owner = array([-1] * 6, int)
    rays = array([[0, -1, 0], [0, -1, 0], [0, -0.5, 0], [0, -0.5, 0], [0, -0.5, 0], [0, -1, 0]],
                 wp.vec3)  # fmt: skip
    wp.launch(level, 1, inputs=[nearest, owner, rays], device="cpu")
    assert owner.numpy().tolist() == [-1, 9, 9, -1, 9, -1]
    assert nearest.numpy()[1:5].tolist() == pytest.approx([2.0, 4.0, 3.9, 4.0])
