"""Two regions, and one where nothing is seen, as a chart and as an element."""

import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from matplotlib.patches import PathPatch

from drone_rl.sim.vocabulary import SHOWN_MOVES
from drone_rl.trust.plots.regions import _ticks, chart, svg

NUMBERS = {
    "window": {"nearest": 2.0, "farthest": 4.0, "sideways": 3.0},
    "touch_distance": 1.5,
    "least_gap_ahead": 3.0,
    "least_gap_left": 2.0,
    "unseen": 0.1,
}
WAYS = {
    "points": np.array(
        [
            *((2, -3), (4, -3), (4, 1), (2, 1)),  # forward, mostly to the right
            *((2, 1), (4, 1), (4, 3), (2, 3)),  # left
            *((2, 2.5), (2.00014, 2.5), (2, 3)),  # not seen
        ],
        float,
    ),
    "ends": np.array([4, 8, 11]),
    "labels": np.array([0, 1, 3]),
}  # fmt: skip


def test_chart_of_regions():
    figure = chart(NUMBERS, WAYS, SHOWN_MOVES)
    (axis,) = figure.axes
    assert axis.get_xlim() == (3, -3)
    forward, left, unseen = (p for p in axis.patches if isinstance(p, PathPatch))
    assert forward.get_path().get_extents().bounds == (-3, 2, 4, 2)
    assert left.get_path().get_extents().bounds == (1, 2, 2, 2)
    assert forward.get_facecolor()[:3] == pytest.approx(np.array(SHOWN_MOVES.colors[0]) / 255)
    assert unseen.get_hatch()
    texts = [text.get_text() for text in axis.get_legend().get_texts()]
    assert texts[:4] == ["goes left", "goes forward", "goes right", "cube not seen"]
    near = NUMBERS["window"]["nearest"]
    assert [text.get_text() for text in axis.texts] == [f"not covered: closer than {near:g} m"]


def corners(words):
    """The corners of one closed way of a path."""
    start, steps = re.fullmatch(r"M(\S+ \S+)l(.+)z", words).groups()
    numbers = [float(n) for n in f"{start} {steps}".split()]
    return np.cumsum(np.reshape(numbers, (-1, 2)), 0)


def test_svg_of_regions():
    root = ElementTree.fromstring(svg(NUMBERS, WAYS, SHOWN_MOVES))
    paths = [p for p in root.iter("path") if p.get("fill-rule")]
    assert [p.get("fill") for p in paths] == ["#cc79a7", "#e69f00", "url(#unseen)"]
    assert corners(paths[0].get("d")).tolist() == [[3, -2], [3, -4], [-1, -4], [-1, -2]]
    assert paths[0].find("title").text == "goes forward"
    small = corners(paths[2].get("d"))
    assert small[:2].tolist() == [[-2.5, -2], [-2.5, -2.0001]]  # to a tenth of a millimetre
    x, y, width, height = map(float, root.get("viewBox").split())
    assert x < -3 and x + width > 3 and y < -4 and y + height > 0
    ring = root.find("circle")
    assert (ring.get("cx"), ring.get("cy")) == ("-2", "-3")
    texts = [text.text for text in root.iter("text")]
    assert {"2 m", "4 m", "goes left", "goes forward", "goes right"} <= set(texts)


@pytest.mark.parametrize(
    ("most", "ticks"), [(20, [0, 5, 10, 15, 20]), (8, [0, 2, 4, 6, 8]), (3, [0, 1, 2, 3])]
)
def test_ticks(most, ticks):
    assert _ticks(most) == ticks
