"""Differences between hand-made images; and a comparison with OpenGL in a few scenes."""

import mujoco
import numpy as np
import pytest

from benchmarks.random_scenes import RandomScenes
from benchmarks.render_truth import Difference, compare


def make_images():
    """Return images of geom 3: 8 x 8 of 12 x 12 pixels, 4 m away, gray, facing the camera."""
    images = {
        "rgb": np.zeros((12, 12, 3), np.uint8),
        "depth": np.zeros((12, 12), np.float32),
        "segmentation": np.full((12, 12), -1, np.int32),
        "normals": np.zeros((12, 12, 3), np.float32),
    }
    inside = (slice(2, 10), slice(2, 10))
    images["rgb"][inside], images["depth"][inside] = 100, 4.0
    images["segmentation"][inside], images["normals"][inside] = 3, [-1.0, 0.0, 0.0]
    images["nudged"] = np.stack([images["segmentation"]] * 4)
    images["facets"] = np.zeros((12, 12))
    return images


def test_equal_images_do_not_differ():
    assert compare(make_images(), make_images()) == Difference(0, (1.0,), 0.0, 0)


def test_another_geom_counts_as_wrong_except_on_an_edge():
    theirs = make_images()
    theirs["segmentation"][2, 5] = -1  # a pixel of the edge
    found = compare(make_images(), theirs)
    assert found.inner_wrong == 0 and found.overlaps == (63 / 64,)
    theirs["segmentation"][4:9, 4:9] = 7  # another geom, of 3 x 3 pixels on no edge
    assert compare(make_images(), theirs).inner_wrong == 9
    assert min(compare(make_images(), theirs).overlaps) == (63 - 25) / 64  # 25 are too few to count


def test_overlap_ignores_pixels_that_depend_on_opengls_rounding():
    ours, theirs = make_images(), make_images()
    theirs["segmentation"][2, 5:7] = -1
    ours["nudged"][3, 2, 5] = -1  # the rotated camera shows the same there
    assert compare(ours, theirs).overlaps == (62 / 63,)


def test_the_depth_difference_excludes_opengls_rounding():
    theirs = make_images()
    theirs["depth"][5, 5] += 0.003
    rounding = 2 * 2.0**-24 * 16 / 0.02  # at 4 m, with the near plane at 2 cm
    assert compare(make_images(), theirs).depth_m == pytest.approx(0.003 - rounding, abs=1e-6)
    theirs["depth"][5, 5] = 4.0 + rounding / 2
    assert compare(make_images(), theirs).depth_m == 0.0
    theirs["depth"][2, 2] = 9.0  # on an edge
    assert compare(make_images(), theirs).depth_m == 0.0


def test_a_steep_surface_may_differ_by_a_fraction_of_a_pixel():
    ours, theirs = make_images(), make_images()
    ours["depth"][2:10, 2:10] += np.arange(8) * 2.56  # 2.56 m per pixel: 10 mm in 1 / 256 pixel
    theirs["depth"] = ours["depth"] + np.float32(0.012) * (ours["depth"] > 0)
    assert 0 < compare(ours, theirs).depth_m < 0.002 + 1e-6


def test_colors_are_compared_within_faces_only():
    ours, theirs = make_images(), make_images()
    theirs["rgb"][5, 5] = 103
    assert compare(ours, theirs).rgb == 3
    ours["normals"][5:10, 2:10] = [0.0, 1.0, 0.0]  # a crease
    assert compare(ours, theirs).rgb == 0


def test_rotated_cameras_shift_the_image_by_a_fraction_of_its_height():
    """The image has a height of 2 tan(fovy / 2) at distance 1."""
    model = RandomScenes(0, nudge=0.01).sample().model
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    axes = data.cam_xmat.reshape(-1, 3, 3)
    height = 2 * np.tan(np.radians(model.cam_fovy[0]) / 2)
    directions = axes[0].T @ -axes[1:, :, 2].T  # in the frame of the first camera
    aside = 0.01 * height * np.array([[-1, 1, 0, 0], [0, 0, 1, -1]])
    np.testing.assert_allclose(directions[:2] / -directions[2], aside, atol=1e-4)
