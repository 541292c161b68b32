"""Bounds of geoms in the image contain all visible pixels and little more."""

import itertools

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
    seen: structs_kernel.ViewArrays,
    scene: structs_kernel.Geoms,
    placed: structs_kernel.PoseArrays,
    buffers: structs_kernel.Scratch,
    part: wp.array[wp.vec4i],
):
    job = start_job(seen, placed, buffers, 0, 0, 0, 0)
    part[0] = bounding_rectangle(job, view_geom(job, scene, 0, placed), wp.vec3())


def found(position, size=(1.0, 1.0, 1.0), attitude=(1.0, 0.0, 0.0, 0.0)):
    """Return first and last column and row."""
    scene = geoms(-6.0)
    scene.attitude = wp.array([attitude], dtype=wp.vec4, device="cpu")
    scene.position = wp.array([position], dtype=wp.vec3, device="cpu")
    scene.reach = wp.array([size], dtype=wp.vec3, device="cpu")
    part = wp.zeros(1, dtype=wp.vec4i, device="cpu")
    given = [view(int(structs_kernel.DEPTH)), scene, poses(), scratch(), part]
    wp.launch(find_visible, 1, inputs=given, device="cpu")
    return part.numpy()[0].tolist()


def test_bounds_of_a_box_ahead():
    """The front covers pixels 16 to 23; the margin is for rounding."""
    assert found((0.0, 0.0, -6.0)) == [14, 25, 14, 25]


def test_box_around_the_camera_covers_the_image():
    assert found((0.0, 0.0, 0.0)) == [0, SIZE, 0, SIZE]


@pytest.mark.parametrize("corner", itertools.product((-1.0, 1.0), repeat=3))
def test_box_with_a_single_corner_behind_the_camera_covers_the_image(corner):
    """The corner is turned to the back, 0.13 m behind the camera, which is inside of the box."""
    unit = np.array(corner) / np.sqrt(3.0)
    turn = np.array([1.0 + unit[2], *np.cross(unit, [0.0, 0.0, 1.0])])
    attitude = (turn / np.linalg.norm(turn)).tolist()
    assert found((0.0, 0.0, -1.6), attitude=attitude) == [0, SIZE, 0, SIZE]
