import numpy as np

from drone_rl.trust.charts import chart, strips
from drone_rl.trust.shifts_results import Robustness, packed
from tests.evidence import SHIFTS

MEASURED = Robustness.read(SHIFTS)
FRAMES = tuple(packed(np.full((25, 64, 3), 40 * i, np.uint8)) for i in range(6))


def test_curves_go_through_the_measured_points():
    figure = chart(MEASURED)
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


def test_chart_without_a_search_has_no_range():
    figure = chart(MEASURED.replace(domain=None))
    labels = [label for axis in figure.axes for label in axis.get_legend_handles_labels()[1]]
    assert "certainly good in this range" not in labels


def test_strips_show_the_tested_strengths():
    one = strips(MEASURED.replace(image_size=(25, 64), pictures={"sun": FRAMES}))
    assert one.height >= 25 * 3 and one.width > 3 * 64 * 3
    counts = {color: count for count, color in one.convert("L").getcolors()}
    shown = {color for color in range(0, 240, 40) if counts.get(color, 0) >= 25 * 64 * 9}
    assert shown == {0, 40, 200}  # strengths 1 and 5 alone were flown
