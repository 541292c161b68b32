import numpy as np

from drone_rl.trust.charts import chart, conditions, curves, strips
from drone_rl.utils.palette import INK
from tests.evidence import SHIFTS, changed

PICTURES = [np.full((25, 64, 3), 40 * i, np.uint8) for i in range(6)]


def test_curves_go_through_what_was_measured():
    figure = chart(SHIFTS)
    sun = figure.axes[0]
    assert sun.get_title() == "elevation of the sun" and sun.get_xlabel() == "degrees"
    policy = next(line for line in sun.lines if line.get_label() == "success rate of the policy")
    np.testing.assert_allclose(policy.get_xdata(), [-55, 0, 5])
    np.testing.assert_allclose(policy.get_ydata(), [0.1, 1.0, 0.995])
    oracle = next(line for line in sun.lines if str(line.get_label()).startswith("oracle"))
    np.testing.assert_allclose(oracle.get_ydata(), [0.45, 1.0, 1.0])
    assert [text.get_text() for text in sun.get_xticklabels()] == ["0", "55", "60"]
    crosses = [line for line in sun.lines if line.get_label() == "impossible"]
    assert [line.get_xdata()[0] for line in crosses] == [-55]
    legend = figure.axes[3].get_legend()
    assert "certainly good in this range" in [text.get_text() for text in legend.get_texts()]


def test_nothing_is_called_good_without_a_search():
    figure = chart(changed(SHIFTS, {"domain": None}))
    labels = [label for axis in figure.axes for label in axis.get_legend_handles_labels()[1]]
    assert "certainly good in this range" not in labels


def test_strips_show_what_was_flown():
    one = strips(SHIFTS, {"sun": PICTURES})
    assert one.height >= 25 * 3 and one.width > 3 * 64 * 3
    two = strips(SHIFTS, {"sun": PICTURES, "blur": [*PICTURES[:3], None, *PICTURES[4:]]})
    assert two.height == 2 * one.height
    counts = {color: count for count, color in one.convert("L").getcolors()}
    shown = {color for color in range(0, 240, 40) if counts.get(color, 0) >= 25 * 64 * 9}
    assert shown == {0, 40, 200}  # strengths 1 and 5 alone were flown


def test_ticks_stand_in_the_order_of_places_also_where_less_is_worse():
    levels = [
        {**level, "value": value, "position": -100 + value}
        for level, value in zip(SHIFTS["axes"]["sun"]["levels"], (80.0, 20.0), strict=True)
    ]
    away = {**SHIFTS["axes"]["sun"], "neutral": None, "levels": levels}
    axis = chart(changed(SHIFTS, {"axes.sun": away})).axes[0]
    assert axis.get_xticks().tolist() == [-80, -20, 0]
    assert [text.get_text() for text in axis.get_xticklabels()] == ["20", "80", "none"]


def test_a_strip_by_the_pixel():
    shown = np.asarray(strips(SHIFTS, {"sun": PICTURES}))
    assert shown.shape == (28 + 22 + 3 * 25 + 6, 3 * (3 * 64 + 8), 3)
    ink = (shown == INK).all(-1)
    assert ink[4:24, :300].any()  # name and unit, above the images
    for number, level in enumerate((0, 40, 200)):  # with nothing different, then strengths 1 and 5
        left = number * 200
        assert (shown[50:125, left : left + 192] == level).all()
    six = changed(
        SHIFTS, {"axes.sun.levels": [{**SHIFTS["axes"]["sun"]["levels"][0], "number": n, "value": n}
        for n in range(1, 6)]})  # fmt: skip
    second = np.asarray(strips(six, {"sun": PICTURES}))
    assert second.shape == (28 + 2 * 97 + 8 + 6, 600, 3)
    assert (second[28 + 97 + 8 + 22 :][:75, :192] == 120).all()  # strength 3, in the second row


def test_a_chart_of_each_axis_and_their_legend():
    charts = curves(SHIFTS)
    assert next(iter(charts)) == "elevation of the sun"
    assert [*charts][-1] == "legend" and len(charts) == 4
    sun = charts["elevation of the sun"].axes[0]
    assert [text.get_text() for text in sun.get_xticklabels()] == ["0", "55", "60"]
    labels = [text.get_text() for text in charts["legend"].axes[0].get_legend().get_texts()]
    assert "success rate of the policy" in labels and "certainly good in this range" in labels


def test_images_are_captioned_with_strength_and_success():
    shown = conditions(SHIFTS, "sun", PICTURES)
    assert [*shown] == ["unperturbed: 100% succeed", "60: 99.5% succeed", "0: 10.0% succeed"]
    assert all(picture.size == (3 * 64, 3 * 25) for picture in shown.values())
