"""Images of a hand-made scene, for each launcher."""

import numpy as np
import pytest
import warp as wp

from drone_rl.sim.rendering.raytrace import structs_kernel
from drone_rl.sim.rendering.raytrace.renderer import CpuLauncher, GpuLauncher
from tests.box_ahead import SIZE, geoms, render


@pytest.fixture(params=["cores", "gpu"])
def launcher(request):
    """Return each launcher; the GPU launcher runs on a CPU as well."""
    made = CpuLauncher(1, 1) if request.param == "cores" else GpuLauncher("cpu")
    yield made
    made.close()


def test_depth_of_the_front_face(launcher):
    depth = render(launcher, "depth", structs_kernel.DEPTH, float)[..., 0]
    # 1 m at 5 m with a half width of 1: a fifth of the 40 pixels
    rows, columns = np.nonzero(depth)
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (16, 23, 16, 23)
    assert depth[20, 20] == pytest.approx(5.0)
    assert (depth > 0).sum() == 64


def test_distance_is_measured_along_the_ray(launcher):
    distance = render(launcher, "distance", structs_kernel.DISTANCE, float)[..., 0]
    slope = 3.5 / 20  # of the fourth pixel from the center
    assert distance[16, 23] == pytest.approx(5.0 * np.sqrt(1 + 2 * slope**2))
    assert (distance > 0).sum() == 64


def test_segmentation_is_the_geom_number(launcher):
    numbers = render(launcher, "segmentation", structs_kernel.SEGMENTATION, int)[..., 0]
    assert numbers[20, 20] == 3 and (numbers == 3).sum() == 64
    assert (numbers == -1).sum() == SIZE**2 - 64


def test_normal_of_the_front_face_points_to_the_camera(launcher):
    normals = render(launcher, "normals", structs_kernel.NORMALS, wp.vec3)
    assert normals[20, 20].tolist() == [0.0, 0.0, 1.0]
    assert (normals != 0).sum() == 64


def test_color_follows_lamberts_law(launcher):
    rgb = render(launcher, "rgb", structs_kernel.RGB, wp.vec3ub)
    # the front faces +z, the cosine of the light is 0.8: 0.2 + 0.6 * 0.8 = 0.68
    assert rgb[20, 20].tolist() == [173, 86, 0]
    assert rgb[0, 0].tolist() == [10, 20, 30]  # the sky


def test_gray_is_the_luma_of_the_color(launcher):
    gray = render(launcher, "gray", structs_kernel.GRAY, float)[..., 0]
    assert gray[20, 20] == pytest.approx((0.299 * 173 + 0.587 * 86) / 255)
    assert gray[0, 0] == pytest.approx((0.299 * 10 + 0.587 * 20 + 0.114 * 30) / 255)


def test_geoms_behind_the_camera_or_too_far_are_invisible(launcher):
    for depth in (6.0, -60.0):
        scene = geoms(depth)
        numbers = render(launcher, "segmentation", structs_kernel.SEGMENTATION, int, scene)
        assert not (numbers == 3).any()


@pytest.mark.parametrize(
    ("depths", "shown"), [((-6.0, -9.0), 1), ((-9.0, -6.0), 2), ((-6.0, -6.0), 2)]
)
def test_nearer_or_later_geom_is_in_front(launcher, depths, shown):
    scene = geoms(*depths, numbers=(1, 2))
    numbers = render(launcher, "segmentation", structs_kernel.SEGMENTATION, int, scene)
    assert numbers[20, 20, 0] == shown
