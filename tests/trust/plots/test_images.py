"""Pictures pixel by pixel, of frames made by hand."""

import numpy as np
from PIL import Image

from drone_rl.trust.plots import images as pictures
from drone_rl.trust.plots.images import SCALE, indicator
from drone_rl.utils.palette import PAPER

BLACK = np.zeros((4, 6, 3), np.uint8)
RED, BLUE = (214, 39, 40), (31, 96, 200)


def colors(picture):
    return {color for _, color in picture.getcolors(1 << 20)}


def test_a_tint_is_mixed_in():
    assert pictures.tint(BLACK, RED, strength=0.5)[0, 0].tolist() == [107, 19, 20]
    assert (pictures.tint(BLACK + 100, BLUE, strength=0.0) == 100).all()


def test_heat_without_a_peak_leaves_the_frame_in_gray():
    frame = BLACK + np.array([30, 60, 90], np.uint8)
    assert (pictures.heated(frame, np.zeros((4, 6))) == 45).all()  # three quarters of the mean


def test_the_hottest_pixel_is_the_brightest():
    heat = np.zeros((4, 6))
    heat[2, 3] = 0.01  # its size does not count, its place does
    lit = pictures.heated(BLACK, heat).sum(-1)
    assert np.unravel_index(lit.argmax(), lit.shape) == (2, 3)
    assert len(np.unique(np.delete(lit.ravel(), 2 * 6 + 3))) == 1


def test_thumbnails_stand_on_their_cells():
    frames = np.stack([BLACK, BLACK])
    picture = pictures.thumbnails(frames, [RED, BLUE], np.array([[0, 0], [2, 1]]))
    assert picture.size == (3 * 6, 2 * 4)
    of = {c: tuple(pictures.tint(BLACK, c)[0, 0].tolist()) for c in (RED, BLUE)}
    assert picture.getpixel((5, 3)) == of[RED]
    assert picture.getpixel((12, 4)) == of[BLUE]
    assert picture.getpixel((6, 0)) == PAPER


def test_pictures_are_enlarged_captioned_stacked_and_gridded():
    picture = pictures.enlarge(BLACK)
    assert picture.size == (6 * SCALE, 4 * SCALE)
    titled = pictures.titled(picture, "a caption")
    assert titled.size == (6 * SCALE, 4 * SCALE + 22)
    assert len(colors(titled)) > 2  # paper, frame, ink
    assert pictures.stacked([picture, titled], gap=3).size == (30, 20 + 3 + 42)
    assert pictures.gridded([picture] * 5, columns=2, gap=10).size == (30 + 10 + 30, 3 * 20 + 20)


def test_a_gray_picture_shows_the_newest_channel_between_its_bounds():
    observation = np.stack([np.full((1, 3), 9.0), np.array([[-1.0, 0.5, 2.0]])])
    gray = pictures.shown_picture(observation, low=0.0, high=1.0, channels="gray")
    assert gray[0, :, 0].tolist() == [0, 127, 255]
    assert (gray == gray[..., :1]).all()


def test_a_picture_in_colors_shows_the_newest_ones():
    older, newer = np.zeros((3, 1, 1)), np.array([-1.0, 0.5, 2.0])[:, None, None]
    for observation in (newer, np.concatenate([older, newer])):
        shown = pictures.shown_picture(observation, low=0.0, high=1.0, channels="rgb")
        assert shown.tolist() == [[[0, 127, 255]]]


def test_chromaticity_shows_red_blue_and_what_they_leave():
    red, blue, gray = [1.0, 0.0], [0.0, 1.0], [0.0, 0.0]
    observation = np.array([red, blue, gray]).T[:, None]
    shown = pictures.shown_picture(observation, 0.0, 1.0, channels="chromaticity")
    assert shown.tolist() == [[[255, 127, 0], [0, 127, 255], [0, 255, 0]]]


def test_a_frame_with_probabilities_has_its_own_bars():
    data = {
        "frames": np.stack([BLACK, BLACK + 255]),
        "actions": np.array([0, 1]),
        "probabilities": np.array([[1.0, 0.0, 0.0], [0.2, 0.5, 0.3]]),
    }
    white = pictures.frame_with_probabilities(data, 1, "x")
    bars = indicator([0.2, 0.5, 0.3], 1, 6 * SCALE)
    assert isinstance(white, Image.Image)
    assert white.size == (30, 42 + 3 + bars.height)
    assert white.getpixel((1, 30)) == (255, 255, 255)
    assert list(white.crop((0, 45, 30, 45 + bars.height)).getdata()) == list(bars.getdata())


def test_where_pictures_of_a_stack_and_of_a_grid_stand():
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


def test_heat_by_the_level():
    heat = np.array([[0.0, 2.0]])
    shown = pictures.heated(np.full((1, 2, 3), 100, np.uint8), heat)
    dark, bright = (np.array(pictures.colormaps["inferno"](v)[:3]) * 255 for v in (0.0, 1.0))
    assert shown[0, 0].tolist() == (75 * 0.85 + dark * 0.15).astype(int).tolist()
    assert shown[0, 1].tolist() == (75 * 0.1 + bright * 0.9).astype(int).tolist()
