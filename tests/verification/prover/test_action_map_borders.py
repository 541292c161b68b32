"""Borders of cameras of few pixels, by hand; and of larger ones, by images."""

import contextlib
import dataclasses

import numpy as np
import pytest

from drone_rl.config import CameraSettings, TaskSettings
from drone_rl.verification.prover import action_map
from drone_rl.verification.prover.action_map import doubtful_area, find_borders
from drone_rl.verification.prover.arrangement import Pieces, Window, arrange
from drone_rl.verification.prover.cube_images import FRONT, LEFT_SIDE, NOTHING, UNIT, CameraModel


def camera(left, up):
    """Cubes with an edge of 2 m."""
    return CameraModel(
        np.array(left, float), np.array(up, float), half=1.0, farthest=10.0, widest=10.0, bound=6.0
    )


def cells(camera, window):
    """Area of what the only pixel shows, and how many cells there are."""
    found = arrange(find_borders(camera, window), window, 10_000)
    faces = camera.faces(*found.inner_points().T)[:, 0, 0]
    areas = np.bincount(faces, found.areas(), 4)
    return {int(face): round(areas[face], 9) for face in np.unique(faces)}, found.num_cells


def test_straight_ahead_a_cube_is_seen_until_it_is_too_small():
    """A ray that rises 0.5 m each metre passes above fronts beyond 2 m, of cubes beyond 3 m."""
    found, count = cells(camera([0.0], [0.5]), Window(1.5, 5.0, 2.0))
    assert found == {FRONT: 2 * 1.5, NOTHING: 14 - 3}
    assert count == 2


def test_a_level_ray_to_the_left_sees_the_front_and_beyond_it_the_side():
    """Front: D - 2 to D; side: to D + 2."""
    found, count = cells(camera([1.0], [0.0]), Window(2.0, 3.0, 6.0))
    assert found == {NOTHING: 8.0, FRONT: 2.0, LEFT_SIDE: 2.0}
    assert count == 4


def test_a_ray_that_leaves_by_the_upper_edge_sees_less_of_the_side():
    """It is above the cube from 2 m on: the side ends at Y = 3 for cubes at 1 to 3 m."""
    found, count = cells(camera([1.0], [0.5]), Window(1.5, 4.0, 4.0))
    assert found == {FRONT: 3.0, LEFT_SIDE: 1.125, NOTHING: 20 - 4.125}
    assert count == 3


def test_twelve_pixels():
    """3 columns 2/3 apart; 4 rows that rise 1/3 and 1, which see cubes as far as 5 and 2.5 m."""
    seen = CameraModel.of(TaskSettings(), CameraSettings(width=3, height=4, horizontal_fov=90))
    np.testing.assert_allclose(seen.left, [2 / 3, 0, -2 / 3], atol=1e-15)
    np.testing.assert_allclose(np.abs(seen.up), [1, 1 / 3, 1 / 3, 1])
    window = Window(2.0, 20.0, 30.0)
    found = find_borders(seen, window)
    lines = np.stack([found.slope, found.offset, found.begin, found.end], -1)
    a, h = 2 / 3, 1.25
    to_the_left = [
        (a, -a * h - h, 2, 5), (a, -a * h + h, 2, 5),  # the front
        (a, a * h + h, 2, 2.5),  # the far edge, where the inner rows see it
        (0, a * 3.75 + h, 2.5, 5), (0, a * 1.25 + h, 2, 2.5),  # where rows leave the side
    ]  # fmt: skip
    to_the_right = [(-s, -o, begin, end) for s, o, begin, end in to_the_left]
    expected = np.array([(0, h, 2, 5), (0, -h, 2, 5), *to_the_left, *to_the_right])

    def ordered(rows):
        return rows[np.lexsort(rows.round(9).T)]

    np.testing.assert_allclose(ordered(lines), ordered(expected), atol=1e-12)
    wide = a * 1.25 + h
    uprights = found.upright[found.upright[:, 0].argsort()]
    np.testing.assert_allclose(uprights, [(2.5, -wide, wide), (5, -3.75, 3.75)])
    cells = arrange(found, window, 100)
    assert cells.num_cells == 16
    faces = seen.faces(*cells.inner_points().T)[:, 0]  # the outer row
    fronts = (faces == FRONT) * cells.areas()[:, None]
    np.testing.assert_allclose(fronts.sum(0), [1.25] * 3)  # 2.5 m wide, from 2 to 2.5 m


CAMERAS = [(7, 5, 100.0), (8, 2, 40.0), (9, 6, 90.0), (16, 7, 135.0), (12, 5, 60.0)]
WINDOW = Window(1.4, 40.0, 9.0)


def missed(camera, found, count=2000):
    """How many of random places have another image than their cell."""
    cells = arrange(found, WINDOW, 100_000)
    random_state = np.random.RandomState(0)
    low, high = (WINDOW.nearest, -WINDOW.sideways), (WINDOW.farthest, WINDOW.sideways)
    places = random_state.uniform(low, high, (count, 2))
    images = camera.faces(*cells.inner_points().T)[cells.locate(places)]
    return int((images != camera.faces(*places.T)).any((1, 2)).sum())


@pytest.mark.parametrize("camera", CAMERAS)
def test_every_place_has_the_picture_of_its_cell(camera):
    width, height, fov = camera
    seen = CameraModel.of(
        TaskSettings(), CameraSettings(width=width, height=height, horizontal_fov=fov)
    )
    found = find_borders(seen, WINDOW)
    assert missed(seen, found) == 0
    cells = arrange(found, WINDOW, 100_000)
    assert cells.areas().min() > 0
    assert cells.areas().sum() == pytest.approx(18.0 * (40.0 - 1.4), rel=1e-12)
    label, twin = cells.cell, cells.cell[cells.twin]
    inner = (label >= 0) & (twin >= 0)
    images = seen.faces(*cells.inner_points().T)
    differ = (images[label[inner]] != images[twin[inner]]).any((1, 2))
    assert differ.all()  # no border parts what is alike


@pytest.mark.parametrize("family", ["near", "far", "side", "levels", "upright"])
def test_no_family_of_borders_can_be_left_out(family, monkeypatch):
    seen = CameraModel.of(TaskSettings(), CameraSettings(width=9, height=6, horizontal_fov=90))
    calls = []

    def without(*args):
        calls.append(args)
        lines = lines_of(*args)
        return lines[:, :0] if len(calls) - 1 == ("near", "far", "side").index(family) else lines

    lines_of = action_map._lines
    if family in ("near", "far", "side"):
        monkeypatch.setattr(action_map, "_lines", without)
    if family == "levels":
        monkeypatch.setattr(action_map, "_levels", lambda *_: [])
    found = find_borders(seen, WINDOW)
    if family == "upright":
        found = dataclasses.replace(found, upright=np.empty((0, 3)))
    with contextlib.suppress(ArithmeticError):  # where what is left hangs in the air
        assert missed(seen, found) > 0


def test_the_doubtful_area_is_a_band_along_each_border():
    """A level border 3 m long at y = 2, an upright one of 4 m."""
    window = Window(2.0, 8.0, 5.0)
    level, upright = np.array([[0.0, 2.0, 3.0, 6.0]]).T, np.array([[4.0, -2.0, 2.0]])
    found = doubtful_area(camera([1.0], [0.5]), Pieces(*level, upright), window)
    band = 2 * (16 * (2 + 1) + 3 * 10) * 3
    assert found == pytest.approx((band + 2 * 32 * 10 * 4) * UNIT)


def test_the_band_along_a_slanting_border_grows_with_its_height():
    """From y = 2 at x = 2 to y = 4 at x = 6, with a slope of a half."""
    window = Window(2.0, 8.0, 5.0)
    line = np.array([[0.5, 1.0, 2.0, 6.0]]).T
    found = doubtful_area(camera([1.0], [0.5]), Pieces(*line, np.empty((0, 3))), window)
    low, high = (16 * (y + 1) + 3 * 0.5 * 10 + 3 * 10 for y in (2, 4))
    assert found == pytest.approx(4 * (low + high) * UNIT)
    far = doubtful_area(
        camera([1.0], [0.5]), Pieces(*line, np.empty((0, 3))), Window(2.0, 19.0, 12.0)
    )
    low, high = (16 * (y + 1) + 3 * 0.5 * 20 + 3 * 12 for y in (2, 4))
    assert far == pytest.approx(4 * (low + high) * UNIT)
