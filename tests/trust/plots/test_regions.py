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


def test_the_chart_has_left_on_the_left():
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


def test_what_is_seen_everywhere_has_no_hatch_in_the_key():
    figure = chart(NUMBERS | {"unseen": 0.0}, WAYS, SHOWN_MOVES)
    texts = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert "cube not seen" not in texts


def corners(words):
    """The corners of one closed way of a path."""
    start, steps = re.fullmatch(r"M(\S+ \S+)l(.+)z", words).groups()
    numbers = [float(n) for n in f"{start} {steps}".split()]
    return np.cumsum(np.reshape(numbers, (-1, 2)), 0)


def test_the_element_has_the_same_corners_turned_upwards():
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
def test_round_numbers(most, ticks):
    assert _ticks(most) == ticks


def test_marks_and_scale_of_the_element_by_the_centimetre():
    """A unit is a 60th of 3 + 4 metres."""
    text = svg(NUMBERS, WAYS, SHOWN_MOVES)
    root = ElementTree.fromstring(text)
    unit = 7 / 60
    box = (-3 - 3 * unit, -4 - unit, 6 + 4 * unit, 4 + 5.5 * unit)
    assert [float(v) for v in root.get("viewBox").split()] == pytest.approx(box, rel=1e-4)
    (camera,) = (p for p in root.iter("path") if p.find("title") is not None
                 and p.find("title").text == "camera")  # fmt: skip
    assert camera.get("d") == "M0 -0.116667L0.0816667 0.07H-0.0816667Z"
    frame = next(p for p in root.iter("path") if p.get("stroke") == "currentColor")
    assert frame.get("d") == "M-3 -2H3V-4H-3Z"
    lines = [p.get("d") for p in root.iter("path") if p.get("stroke-dasharray")]
    assert lines == ["M-1.5 -2V-4", "M1.5 -2V-4"]
    key = [(float(r.get("x")), float(r.get("y"))) for r in root.findall("rect")]
    assert [x for x, _ in key] == [-3, -1, 1]
    assert [y for _, y in key] == pytest.approx([2.2 * unit] * 3, rel=1e-4)
    aside = [t for t in root.iter("text") if t.get("text-anchor") == "middle"]
    assert [float(t.get("x")) for t in aside] == [-1, 1, -2, 2, -3, 3]
    assert [t.text for t in aside] == ["1 m", "1 m", "2 m", "2 m", "3 m", "3 m"]
    assert float(aside[0].get("y")) == pytest.approx(1.2 * unit - 2, rel=1e-4)


def test_the_charts_outlines_are_closed_and_its_size_follows_the_window():
    figure = chart(NUMBERS, WAYS, SHOWN_MOVES)
    assert figure.get_size_inches() == pytest.approx([9.0, 1.6 + 0.88 * 9.0 * 4 / 6])
    forward = next(p for p in figure.axes[0].patches if isinstance(p, PathPatch)).get_path()
    assert forward.codes.tolist() == [1, 2, 2, 2, 79]
    touch = [line.get_xdata()[0] for line in figure.axes[0].lines if len(line.get_xdata()) == 2]
    assert [x for x in touch if abs(x) == 1.5] == [-1.5, -1.5, 1.5, 1.5]
    labels = [t.get_text() for t in figure.axes[0].get_legend().get_texts()]
    assert labels.count("beyond: flying straight on misses it") == 1
