"""One call of the kernel, with everything given by hand: a box of 2 m, 5 m before the camera."""

import numpy as np
import pytest
import warp as wp

from drone_rl.sim.rendering import raytrace_kernel as kernel
from drone_rl.sim.rendering.raytrace_scene import make_rays
from drone_rl.sim.rendering.raytrace_solids import BOX

SIZE = 40


def camera():
    made = kernel.Camera()
    made.frame, made.position = 0, wp.vec3(0.0, 0.0, 0.0)
    made.attitude = wp.vec4(1.0, 0.0, 0.0, 0.0)  # looks along -z
    made.half_width = made.half_height = 1.0
    made.width = made.height = SIZE
    made.far = 50.0
    return made


def array(values, dtype):
    return wp.array(values, dtype=dtype, device="cpu")


def geoms(*depths, numbers=(3,)):
    count, made = len(numbers), kernel.Geoms()
    made.kind, made.frame = array([int(BOX)] * count, int), array([0] * count, int)
    made.number = array(numbers, int)
    made.position = array([[0.0, 0.0, z] for z in depths or (-6.0,)], wp.vec3)
    made.attitude = array([[1.0, 0.0, 0.0, 0.0]] * count, wp.vec4)
    made.size = made.reach = array([[1.0, 1.0, 1.0]] * count, wp.vec3)
    return made


def looks():
    made = kernel.Looks()
    made.colors = array([[[0.0] * 3] * 3 + [[1.0, 0.5, 0.0]]], wp.vec3)
    made.ambient = array([[[0.2, 0.2, 0.2]]], wp.vec3)
    made.diffuse = array([[[0.6, 0.6, 0.6]]], wp.vec3)
    made.direction = array([[[0.0, -0.6, -0.8]]], wp.vec3)
    return made


def drawn(what, shape, dtype, scene=None):
    seen = camera()
    directions = make_rays(seen).reshape(-1, 3)
    out = wp.zeros((1, shape), dtype=dtype, device="cpu")
    outs = [out if what == i else None for i in range(3)]
    given = [
        *(0, 1, what, seen, array(directions, wp.vec3)),
        scene or geoms(),
        array([[[0.0, 0.0, 0.0]]], wp.vec3),
        array([[1.0, 0.0, 0.0, 0.0]], wp.vec4),
        looks(),
        wp.zeros(SIZE * SIZE, dtype=float, device="cpu"),
        *outs,
    ]
    wp.launch(kernel.draw, 1, inputs=given, device="cpu")
    return out.numpy().reshape(SIZE, SIZE, -1)


def test_its_front_is_a_square_at_its_distance():
    depth = drawn(kernel.DEPTH, SIZE * SIZE, float)[..., 0]
    # half a metre in five of a picture that is one in one: a fifth of its 40 pixels
    rows, columns = np.nonzero(depth)
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (16, 23, 16, 23)
    assert depth[20, 20] == pytest.approx(5.0)
    assert (depth > 0).sum() == 64


def test_its_pixels_have_its_number():
    numbers = drawn(kernel.SEGMENTATION, SIZE * SIZE, int)[..., 0]
    assert numbers[20, 20] == 3 and (numbers == 3).sum() == 64


def test_its_colour_is_lamberts():
    rgb = drawn(kernel.RGB, 3 * SIZE * SIZE, wp.uint8)
    # its front faces +z, the light comes down at a cosine of 0.8: 0.2 + 0.6 * 0.8 = 0.68
    assert rgb[20, 20].tolist() == [173, 86, 0]
    assert not rgb[0].any()


def test_what_lies_behind_the_camera_or_too_far_is_not_there():
    for depth in (6.0, -60.0):
        numbers = drawn(kernel.SEGMENTATION, SIZE * SIZE, int, geoms(depth))
        assert not (numbers == 3).any()


def test_the_nearer_is_in_front_and_of_the_same_the_later():
    for depths, shown in (((-6.0, -9.0), 1), ((-9.0, -6.0), 2), ((-6.0, -6.0), 2)):
        scene = geoms(*depths, numbers=(1, 2))
        assert drawn(kernel.SEGMENTATION, SIZE * SIZE, int, scene)[20, 20, 0] == shown
