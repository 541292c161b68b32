"""Pictures pixel by pixel, of frames made by hand."""

import numpy as np
import pytest
from PIL import Image

from drone_rl.sim.vocabulary import ShownActions
from drone_rl.trust.plots import images as pictures
from drone_rl.trust.plots.images import ROW, indicator
from drone_rl.utils.palette import INK, MUTED, NEXT_CUBE, PAPER, SKY

BLACK = np.zeros((4, 6, 3), np.uint8)
RED, BLUE = (214, 39, 40), (31, 96, 200)


def colors(picture):
    return {color for _, color in picture.getcolors(1 << 20)}


def test_tint():
    assert pictures.tint(BLACK, RED, strength=0.5)[0, 0].tolist() == [107, 19, 20]
    assert (pictures.tint(BLACK + 100, BLUE, strength=0.0) == 100).all()


def test_heat_map_without_a_peak():
    frame = BLACK + np.array([30, 60, 90], np.uint8)
    assert (pictures.heated(frame, np.zeros((4, 6))) == 45).all()  # three quarters of the mean


def test_hottest_pixel_is_the_brightest():
    heat = np.zeros((4, 6))
    heat[2, 3] = 0.01  # its size does not count, its place does
    lit = pictures.heated(BLACK, heat).sum(-1)
    assert np.unravel_index(lit.argmax(), lit.shape) == (2, 3)
    assert len(np.unique(np.delete(lit.ravel(), 2 * 6 + 3))) == 1


def test_gray_observation():
    observation = np.stack([np.full((1, 3), 9.0), np.array([[-1.0, 0.5, 2.0]])])
    gray = pictures.shown_picture(observation, low=0.0, high=1.0, channels="gray")
    assert gray[0, :, 0].tolist() == [0, 127, 255]
    assert (gray == gray[..., :1]).all()


def test_color_observation():
    older, newer = np.zeros((3, 1, 1)), np.array([-1.0, 0.5, 2.0])[:, None, None]
    for observation in (newer, np.concatenate([older, newer])):
        shown = pictures.shown_picture(observation, low=0.0, high=1.0, channels="rgb")
        assert shown.tolist() == [[[0, 127, 255]]]


def test_chromaticity_observation():
    red, blue, gray = [1.0, 0.0], [0.0, 1.0], [0.0, 0.0]
    observation = np.array([red, blue, gray]).T[:, None]
    shown = pictures.shown_picture(observation, 0.0, 1.0, channels="chromaticity")
    assert shown.tolist() == [[[255, 127, 0], [0, 127, 255], [0, 255, 0]]]


def test_segmentation():
    target, sky, none = [1.0, 0, 0, 0, 0], [0, 0, 0, 0, 1.0], [0.0] * 5
    observation = np.array([target, sky, none]).T[:, None]
    shown = pictures.shown_picture(observation, 0.0, 1.0, channels="classes")
    assert shown.tolist() == [[list(NEXT_CUBE), list(SKY), [0, 0, 0]]]


def test_stack_and_grid_of_images():
    parts = [Image.new("RGB", (4, 3), (shade, 0, 0)) for shade in (50, 100, 150, 200, 250)]
    stack = np.asarray(pictures.stacked([parts[0], parts[1].resize((2, 3))], gap=2))
    assert stack.shape == (8, 4, 3)
    assert (stack[:3] == (50, 0, 0)).all() and (stack[3:5] == PAPER).all()
    assert (stack[5:, :2] == (100, 0, 0)).all() and (stack[5:, 2:] == PAPER).all()
    grid = np.asarray(pictures.gridded(parts, columns=2, gap=1))
    assert grid.shape == (3 * 3 + 2, 9, 3)
    corners = [(0, 0), (0, 5), (4, 0), (4, 5), (8, 0)]
    for (y, x), part in zip(corners, parts, strict=True):
        assert (grid[y : y + 3, x : x + 4] == np.asarray(part)).all()
    assert (grid[8:, 4:] == PAPER).all() and (grid[3] == PAPER).all()


FIVE = ShownActions(
    names=("up", "down", "left", "right", "stay"),
    order=(2, 0, 4, 1, 3),
    arrows=((0.0, 1.0), (0.0, -1.0), (-1.0, 0.0), (1.0, 0.0), (0.0, 0.0)),
    colors=((0, 0, 0),) * 5,
)


def bars(picture, color):
    """Where a color is, right of the names."""
    found = (np.asarray(picture) == color).all(-1)
    found[:, : picture.width // 2] = False
    return found


@pytest.mark.parametrize("chosen", [0, 1, 2])
def test_bars_are_as_long_as_probabilities(chosen):
    def count(probabilities, color):
        return int(bars(indicator(probabilities, chosen, 300), color).sum())

    sure = [0.0, 0.0, 0.0]
    sure[chosen] = 1.0
    half = [0.5 * p for p in sure]
    assert count(sure, INK) == pytest.approx(2 * count(half, INK), rel=0.1)
    assert count(sure, MUTED) < count([1 - p for p in sure], MUTED)


def test_actions_have_a_row_each():
    picture = indicator([0.0, 0.1, 0.6, 0.2, 0.1], 2, 300, FIVE)
    assert picture.size == (300, 5 * ROW + 4)
    rows, columns = bars(picture, INK).nonzero()
    assert rows.max() < ROW + 4  # left is the first
    assert np.ptp(columns) == pytest.approx(0.6 * 144, abs=1)
    others, _ = bars(picture, MUTED).nonzero()
    assert others.min() > ROW


def test_narrow_frames_are_as_wide_as_captions_need():
    """Frames of 24 pixels are enlarged to at least 64 x 5 pixels, 14 times; wider ones 5 times."""
    sizes = [pictures.enlarge(np.zeros((12, width, 3), np.uint8)).size for width in (24, 64, 128)]
    assert sizes == [(336, 168), (320, 60), (640, 60)]
