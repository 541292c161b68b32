"""Images of a scene that is given by hand, by whoever paints."""

import numpy as np
import pytest
import warp as wp

from drone_rl.sim.rendering.raytrace import structs_kernel
from drone_rl.sim.rendering.raytrace.renderer import CpuLauncher, GpuLauncher
from tests.box_ahead import SIZE, geoms, render


@pytest.fixture(params=["cores", "gpu"])
def launcher(request):
    """Also the one for GPUs, which draws on a CPU, too."""
    made = CpuLauncher(1, 1) if request.param == "cores" else GpuLauncher("cpu")
    yield made
    made.close()


def test_its_front_is_a_square_at_its_distance(launcher):
    depth = render(launcher, "depth", structs_kernel.DEPTH, float)[..., 0]
    # half a metre in five of a picture that is one in one: a fifth of its 40 pixels
    rows, columns = np.nonzero(depth)
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (16, 23, 16, 23)
    assert depth[20, 20] == pytest.approx(5.0)
    assert (depth > 0).sum() == 64


def test_along_a_ray_it_is_farther_than_along_the_axis(launcher):
    distance = render(launcher, "distance", structs_kernel.DISTANCE, float)[..., 0]
    slope = 3.5 / 20  # of the fourth pixel from the middle, across and down
    assert distance[16, 23] == pytest.approx(5.0 * np.sqrt(1 + 2 * slope**2))
    assert (distance > 0).sum() == 64


def test_its_pixels_have_its_number(launcher):
    numbers = render(launcher, "segmentation", structs_kernel.SEGMENTATION, int)[..., 0]
    assert numbers[20, 20] == 3 and (numbers == 3).sum() == 64
    assert (numbers == -1).sum() == SIZE**2 - 64


def test_its_normal_looks_at_the_camera(launcher):
    normals = render(launcher, "normals", structs_kernel.NORMALS, wp.vec3)
    assert normals[20, 20].tolist() == [0.0, 0.0, 1.0]
    assert (normals != 0).sum() == 64


def test_its_colour_is_lamberts(launcher):
    rgb = render(launcher, "rgb", structs_kernel.RGB, wp.vec3ub)
    # its front faces +z, the light comes down at a cosine of 0.8: 0.2 + 0.6 * 0.8 = 0.68
    assert rgb[20, 20].tolist() == [173, 86, 0]
    assert rgb[0, 0].tolist() == [10, 20, 30]  # the sky


def test_gray_is_its_colours_luma(launcher):
    gray = render(launcher, "gray", structs_kernel.GRAY, float)[..., 0]
    assert gray[20, 20] == pytest.approx((0.299 * 173 + 0.587 * 86) / 255)
    assert gray[0, 0] == pytest.approx((0.299 * 10 + 0.587 * 20 + 0.114 * 30) / 255)


def test_what_lies_behind_the_camera_or_too_far_is_not_there(launcher):
    for depth in (6.0, -60.0):
        scene = geoms(depth)
        numbers = render(launcher, "segmentation", structs_kernel.SEGMENTATION, int, scene)
        assert not (numbers == 3).any()


@pytest.mark.parametrize(
    ("depths", "shown"), [((-6.0, -9.0), 1), ((-9.0, -6.0), 2), ((-6.0, -6.0), 2)]
)
def test_the_nearer_is_in_front_and_of_the_same_the_later(launcher, depths, shown):
    scene = geoms(*depths, numbers=(1, 2))
    numbers = render(launcher, "segmentation", structs_kernel.SEGMENTATION, int, scene)
    assert numbers[20, 20, 0] == shown
