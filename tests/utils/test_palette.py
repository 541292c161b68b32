"""Colors that readers with a color vision deficiency can tell apart, and text that is legible."""

import itertools

import numpy as np
import pytest

from drone_rl.utils import palette

DEFICIENCIES = {
    "protanopia": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "deuteranopia": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
}
"""Linear RGB as seen; Machado, Oliveira and Fernandes, 2009, severity 1."""
XYZ = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
ACTIONS = (palette.FORWARD, palette.LEFT, palette.RIGHT)


def linear(color):
    share = np.array(color) / 255
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


def lab(light):
    x, y, z = np.cbrt(XYZ @ light.clip(1e-3, 1) / np.array([0.9505, 1.0, 1.089]))
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def contrast(one, other):
    """Contrast ratio of WCAG."""
    high, low = sorted((0.05 + XYZ[1] @ linear(c) for c in (one, other)), reverse=True)
    return high / low


def rgb(text):
    return tuple(int(text[i : i + 2], 16) for i in (1, 3, 5))


@pytest.mark.parametrize("seen", [np.eye(3), *map(np.array, DEFICIENCIES.values())])
@pytest.mark.parametrize(
    "colors",
    [ACTIONS, (*ACTIONS, palette.NEXT_CUBE), (palette.GOOD, palette.BAD, palette.MUTED)],
)
def test_colors_of_one_image_differ_for_everybody(seen, colors):
    """A difference of 2.3 is just noticeable."""
    for one, other in itertools.combinations(colors, 2):
        assert np.linalg.norm(lab(seen @ linear(one)) - lab(seen @ linear(other))) > 15


def test_one_color_has_one_meaning():
    colors = [value for name, value in vars(palette).items() if name.isupper()]
    assert len(set(colors)) == len(colors) >= 15


def test_text_on_areas_of_a_verdict_is_legible():
    for color in (palette.GOOD, palette.BAD, palette.ONE_SIDED, palette.EMPTY):
        assert contrast(palette.INK, palette.light(color)) > 4.5
        assert contrast(palette.FAINT, palette.light(color, 0.2)) > 4.5
    assert palette.light((0, 100, 255), 0.5) == (128, 178, 255)
    assert palette.css((0, 158, 115)) == "#009e73"
