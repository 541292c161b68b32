"""Texels of the sides of skies and boxes."""

import numpy as np
import pytest

from drone_rl.sim.rendering.opengl import _mip_level, _points, box_sides, flat, sky_sides
from drone_rl.sim.rendering.textures import levels

QUARTERS = np.array([[[10] * 3, [20] * 3], [[30] * 3, [40] * 3]], np.uint8)
"""Order: upper left, upper right, lower left, lower right."""


def test_sky_texture_blends_from_horizon_to_zenith():
    sides = sky_sides(9, np.zeros(3), np.ones(3))
    assert sides.shape == (6, 9, 9, 3) and (sides[3] == 0).all()  # below
    assert (sides[2, 4, 4] == 255).all()  # overhead
    for side in (0, 1, 4, 5):
        assert (sides[side, 4:] == 0).all()  # the horizon and below
        # middle of the top row: 8/9 up at 1 ahead
        assert sides[side, 0, 4, 0] == round(255 * (8 / 9) / np.hypot(8 / 9, 1.0))


def test_box_texture_is_centered_on_each_side():
    sides = box_sides(4, QUARTERS, np.array([1.0, 1.0, 1.0]), 1.0)
    assert sides.shape == (6, 4, 4, 3)
    # from above, +z: x right, y up; a tile right of and below the center
    assert sides[4, 2:, 2:, 0].tolist() == [[10, 20], [30, 40]]
    assert sides[4, :2, :2, 0].tolist() == [[10, 20], [30, 40]]
    # +x: OpenGL's columns run along -z, its rows along -y; the texture runs along y and -z
    assert sides[0, :2, 2:, 0].tolist() == [[20, 40], [10, 30]]


def test_small_tiles_become_their_mean():
    sides = box_sides(4, QUARTERS, np.array([1.0, 1.0, 1.0]), 0.25)
    assert (sides == 25).all()


@pytest.mark.parametrize("side", [1, 4])
def test_textures_are_resized(side):
    assert (flat(None, side) == 255).all()
    assert flat(QUARTERS, side).shape == (side, side, 3)
    assert flat(QUARTERS, 4)[0, :, 0].tolist() == [10, 10, 20, 20]


def test_texel_positions_of_each_side():
    """Upper left, upper right and lower left of four texels, in OpenGL's cube map order."""
    expected = [
        [(1, 1, 1), (1, 1, -1), (1, -1, 1)],
        [(-1, 1, -1), (-1, 1, 1), (-1, -1, -1)],
        [(-1, 1, -1), (1, 1, -1), (-1, 1, 1)],
        [(-1, -1, 1), (1, -1, 1), (-1, -1, -1)],
        [(-1, 1, 1), (1, 1, 1), (-1, -1, 1)],
        [(1, 1, -1), (-1, 1, -1), (1, -1, -1)],
    ]
    for number, (side, points) in enumerate(zip(_points(2), expected, strict=True)):
        half = np.where(np.arange(3) == number // 2, 1.0, 0.5)  # texels are halfway to the edge
        found = [side[0, 0], side[0, 1], side[1, 0]]
        assert np.array_equal(found, np.array(points) * half), number


def test_mip_level_matches_the_requested_size():
    image = np.arange(48, dtype=np.uint8).reshape(4, 4, 3)
    rows = levels(image)
    assert np.array_equal(_mip_level(image, 0.49), image)
    assert np.array_equal(_mip_level(image, 0.5), rows[16:20].reshape(2, 2, 3))
    assert np.array_equal(_mip_level(image, 1.0), rows[20:21].reshape(1, 1, 3))
