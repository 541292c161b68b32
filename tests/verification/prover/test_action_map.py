"""The exact map of actions: borders and areas by hand, and against the closed form everywhere."""

import numpy as np
import pytest
import shapely
import torch

from drone_rl.config import CameraSettings, TaskSettings
from drone_rl.sim.actions import Move
from drone_rl.verification.prover.action_map import (
    doubtful_area,
    find_borders,
    map_actions,
)
from drone_rl.verification.prover.arrangement import Pieces, Window, arrange
from drone_rl.verification.prover.cube_images import NOTHING, UNIT, CameraModel


def camera(left, up):
    """Cubes with an edge of 2 m."""
    return CameraModel(
        np.array(left, float), np.array(up, float), half=1.0, farthest=10.0, widest=10.0, bound=6.0
    )


WIDE = Window(1.4, 40.0, 9.0)


CAMERAS = [(7, 5, 100.0), (8, 2, 40.0), (9, 6, 90.0), (16, 7, 135.0), (12, 5, 60.0)]


def missed(camera, found, count=2000):
    """How many of random places have another image than their cell."""
    cells = arrange(found, WIDE, 100_000)
    random_state = np.random.RandomState(0)
    low, high = (WIDE.nearest, -WIDE.sideways), (WIDE.farthest, WIDE.sideways)
    places = random_state.uniform(low, high, (count, 2))
    images = camera.faces(*cells.inner_points().T)[cells.locate(places)]
    return int((images != camera.faces(*places.T)).any((1, 2)).sum())


@pytest.mark.parametrize("camera", CAMERAS)
def test_images_are_constant_within_cells(camera):
    width, height, fov = camera
    seen = CameraModel.of(
        TaskSettings(), CameraSettings(width=width, height=height, horizontal_fov=fov)
    )
    found = find_borders(seen, WIDE)
    assert missed(seen, found) == 0
    cells = arrange(found, WIDE, 100_000)
    assert cells.areas().min() > 0
    assert cells.areas().sum() == pytest.approx(18.0 * (40.0 - 1.4), rel=1e-12)
    one, other = shapely.STRtree(cells.cells).query(cells.cells, "touches")
    common = shapely.length(shapely.intersection(cells.cells[one], cells.cells[other]))
    is_beside = common > 1e-9
    images = seen.faces(*cells.inner_points().T)
    differ = (images[one[is_beside]] != images[other[is_beside]]).any((1, 2))
    assert is_beside.sum() > len(cells.cells) and differ.all()  # no border parts what is alike


def test_doubtful_area():
    """A level border 3 m long at y = 2, an upright one of 4 m."""
    window = Window(2.0, 8.0, 5.0)
    level, upright = np.array([[0.0, 2.0, 3.0, 6.0]]).T, np.array([[4.0, -2.0, 2.0]])
    found = doubtful_area(camera([1.0], [0.5]), Pieces(*level, upright), window)
    band = 2 * (16 * (2 + 1) + 3 * 10) * 3
    assert found == pytest.approx((band + 2 * 32 * 10 * 4) * UNIT)


EYE = CameraModel(
    np.array([1.0, -1.0]), np.array([0.0]), half=1.0, farthest=10.0, widest=10.0, bound=6.0
)
"""A pixel sees half left, one half right: fronts at Y = +-(D - 2 to D), sides to +-(D + 2)."""


WINDOW = Window(4.0, 5.0, 10.0)


def look(faces):
    """Bright where there is something of a cube."""
    return torch.from_numpy((faces != NOTHING).astype(np.float32))[:, None]


class Turns(torch.nn.Module):
    """Turns to the pixel that is bright; flies on by a gap of 0.5 where none is."""

    def forward(self, images):
        left, right = images[:, 0, 0].T
        return torch.stack([torch.full_like(left, 0.5), left, 0.8 * right], -1)


@pytest.fixture(scope="module")
def found():
    return map_actions(EYE, WINDOW, look, Turns(), touch_distance=3.0, most_cells=100)


def test_areas_and_actions(found):
    """To either side: nothing to D - 2, front to D, side to D + 2, nothing to 10."""
    assert len(found.action) == 7
    assert found.alone == Move.FORWARD
    assert found.areas.sum() == pytest.approx(20)
    assert found.areas[found.action == Move.LEFT].sum() == pytest.approx(4)
    assert found.areas[found.action == Move.RIGHT].sum() == pytest.approx(4)
    assert found.areas[found.is_unseen].sum() == pytest.approx(12)
    places = np.array([[4.5, 3.0], [4.5, -3.0], [4.5, 0.0], [4.5, 9.0], [4.1, 6.0], [4.1, 6.2]])
    assert found.at(places).tolist() == [1, 2, 0, 0, 1, 0]


def test_summary(found):
    """Beyond 3 m to the left: nothing below D - 2 = 2..3 is left out; 6..7 to 10 is not seen."""
    told = found.summary(0.31)
    assert told.cells == 7 and told.area == pytest.approx(20)
    assert told.sides["ahead"].share == pytest.approx(0.3)
    left, ahead = told.sides["left"], told.sides["ahead"]
    assert left.actions == pytest.approx([3.5 / 7, 3.5 / 7, 0])
    assert left.unseen == left.blind == pytest.approx(0.5)
    assert ahead.actions == pytest.approx([5 / 6, 0.5 / 6, 0.5 / 6])
    assert ahead.blind == 0
    assert told.actions == pytest.approx([0.6, 0.2, 0.2])
    assert (told.unseen, told.blind) == pytest.approx((0.6, 0.35))
    assert told.least_gap == pytest.approx(0.3)  # right: 0.8 against 0.5
    assert told.least_gap_left < -2
    assert told.close == pytest.approx(0.2)
    assert found.summary(0.2).close == 0
    assert 0 < told.in_doubt < 1e-4


def test_outlines(found):
    ways = found.outlines()
    assert ways.labels.tolist().count(1) == 1 and ways.labels.tolist().count(3) == 3
    parts = dict(zip(ways.labels, np.split(ways.points, ways.ends[:-1]), strict=True))
    np.testing.assert_allclose(
        sorted(parts[1].tolist()), [[4, 2], [4, 6], [5, 3], [5, 7]], atol=1e-12
    )
