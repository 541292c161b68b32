"""The rectangle around a geom holds whatever can be seen of it, and little more."""

import numpy as np
import pytest
import warp as wp

from drone_rl.sim.rendering.raytrace import structs_kernel
from drone_rl.sim.rendering.raytrace.projection_kernel import (
    bounding_rectangle,
    start_job,
    view_geom,
)
from tests.box_ahead import SIZE, geoms, poses, scratch, view


@wp.kernel(enable_backward=False)
def find_visible(
    seen: structs_kernel.View,
    scene: structs_kernel.Geoms,
    placed: structs_kernel.Poses,
    buffers: structs_kernel.Scratch,
    part: wp.array[wp.vec4i],
):
    job = start_job(seen, placed, buffers, 0, 0, 0, 0)
    part[0] = bounding_rectangle(job, view_geom(job, scene, 0, placed), wp.vec3())


def found(position, size=(1.0, 1.0, 1.0)):
    """Columns and rows, from and to."""
    scene = geoms(-6.0)
    scene.position = wp.array([position], dtype=wp.vec3, device="cpu")
    scene.reach = wp.array([size], dtype=wp.vec3, device="cpu")
    part = wp.zeros(1, dtype=wp.vec4i, device="cpu")
    given = [view(int(structs_kernel.DEPTH)), scene, poses(), scratch(), part]
    wp.launch(find_visible, 1, inputs=given, device="cpu")
    return part.numpy()[0].tolist()


def test_around_a_box_ahead():
    """Its front takes the pixels 16 to 23; a pixel more is for rounding."""
    assert found((0.0, 0.0, -6.0)) == [14, 25, 14, 25]


@pytest.mark.parametrize(
    "position", [(0.0, 0.0, 6.0), (30.0, 0.0, -6.0), (0.0, -30.0, -6.0), (5.0, 0.0, 1.5)]
)
def test_what_is_behind_or_aside_takes_no_pixel(position):
    first, last, top, bottom = found(position)
    assert first >= last or top >= bottom


def test_around_the_camera_it_is_the_whole_picture():
    assert found((0.0, 0.0, 0.0)) == [0, SIZE, 0, SIZE]


def test_beside_the_camera_it_is_a_part():
    """A wall from 1 m behind the camera to 1 m before it, 0.5 m to the right: from half way on."""
    first, last, top, bottom = found((1.5, 0.0, 0.0))
    assert (last, top, bottom) == (SIZE, 0, SIZE)
    assert first == 20 + 10 - 2  # a slope of 0.5 is half way to the edge


def test_frames_carry_what_is_fixed_to_them():
    """A camera on the drone, which is turned to look along x; the box is the world's."""
    turned = poses()
    half = np.sqrt(0.5)
    turned.positions = wp.array([[[0, 0, 0], [1.0, 2.0, 3.0]]], dtype=wp.vec3, device="cpu")
    turned.attitudes = wp.array([[half, 0.0, -half, 0.0]], dtype=wp.vec4, device="cpu")
    seen = view(int(structs_kernel.DEPTH))
    camera = structs_kernel.Camera()
    camera.frame, camera.attitude = 1, wp.vec4(1.0, 0.0, 0.0, 0.0)
    camera.half_width = camera.half_height = 1.0
    seen.cameras = wp.array([camera], dtype=structs_kernel.Camera, device="cpu")
    scene = geoms(-6.0)
    scene.position = wp.array([[7.0, 2.0, 3.0]], dtype=wp.vec3, device="cpu")
    part = wp.zeros(1, dtype=wp.vec4i, device="cpu")
    wp.launch(find_visible, 1, inputs=[seen, scene, turned, scratch(), part], device="cpu")
    assert part.numpy()[0].tolist() == [14, 25, 14, 25]
