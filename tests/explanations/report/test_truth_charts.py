import pytest
from matplotlib.colors import to_hex

from drone_rl.explanations.report.explanation import Explanation
from drone_rl.explanations.report.truth import heat_chart, truth_charts
from drone_rl.utils.palette import FAINT, GOOD, MUTED, css

SCORE = {"mean": 0.5, "lower95": 0.4, "upper95": 0.6}
UNKNOWN = {"mean": None, "lower95": None, "upper95": None}


def beats(lower, upper, median):
    return {"lower": lower, "upper": upper, "median": median}


@pytest.fixture
def truth():
    return {
        "methods": {
            "grad_cam": {
                "score": SCORE,
                "placebos": {"ones": beats(0.3, 0.5, 0.4), "blob": beats(0.1, 0.9, 0.6)},
                "pointing": beats(0.2, 0.4, 0.3),
                "likeness": beats(0.6, 0.8, 0.7),
            },
            "saliency": {"score": UNKNOWN, "pointing": beats(None, None, None)},
        },
        "placebos": {"ones": {**SCORE, "mean": 0.1}, "blob": {**SCORE, "mean": 0.2}},
        "heat": {
            "grad_cam": {
                region: {"share": {"mean": share}, "chance": {"mean": 0.2}}
                for region, share in zip(
                    ("next_cube", "other_cubes", "drone", "ground", "sky"),
                    (0.5, 0.1, 0.1, 0.1, 0.2), strict=True,
                )
            }
        },
    }  # fmt: skip


def draw(chart, truth):
    drawn = chart(Explanation({"name": "x", "truth": truth}, {}, {}))
    figures = drawn.values() if isinstance(drawn, dict) else [drawn]
    return [figure.axes[0] for figure in figures]


def test_scores_stand_with_the_strongest_placebo_below_the_methods(truth):
    axis = draw(truth_charts, truth)[0]
    labels = [label.get_text() for label in axis.get_yticklabels()]
    assert labels == ["placebo: ones", "placebo: blob", "saliency", "Grad-CAM"]
    assert [bar.get_width() for bar in axis.patches] == [0.1, 0.2, 0.5]  # saliency has none


def test_a_chart_without_any_score_says_why_it_is_empty(truth):
    for one in (*truth["methods"].values(), *truth["placebos"].values()):
        one |= {"score": UNKNOWN, **UNKNOWN}
    (text,) = draw(truth_charts, truth)[0].texts
    assert text.get_text() == "no patch of any frame\naffects this policy"
    for method in truth["methods"].values():
        method |= {"placebos": {}, "pointing": None, "likeness": None}
    for axis in draw(truth_charts, truth)[1:]:
        assert axis.texts[0].get_text() == text.get_text()
    for axis in draw(truth_charts, {**truth, "methods": {}})[1:]:
        assert axis.texts[0].get_text() == "no method was tested"


def test_only_a_trusted_method_is_green(truth):
    truth["methods"]["grad_cam"]["trusted"] = True
    truth["methods"]["saliency"] |= {"score": SCORE, "trusted": False}
    bars = draw(truth_charts, truth)[0].patches
    colors = [to_hex(bar.get_facecolor()) for bar in bars]
    assert colors == [css(MUTED), css(MUTED), css(FAINT), css(GOOD)]


def test_the_placebo_that_is_beaten_least_surely_is_the_one_that_counts(truth):
    axis = draw(truth_charts, truth)[1]
    bounds, median = axis.lines[:2]
    assert list(bounds.get_xdata()) == [0.1, 0.9]
    assert list(median.get_xdata()) == [0.6]


def test_what_has_too_few_flights_says_so(truth):
    texts = [text.get_text().strip() for text in draw(truth_charts, truth)[2].texts]
    assert "too few episodes" in texts


def test_shares_of_heat_stand_beside_shares_of_pixels_and_fill_the_line(truth):
    (axis,) = draw(heat_chart, truth)
    widths = [bar.get_width() for bar in axis.patches]
    assert widths[:5] == pytest.approx([0.5, 0.1, 0.1, 0.1, 0.2])
    assert widths[5:] == pytest.approx([0.2] * 5)
    assert [t.get_text() for t in axis.get_yticklabels()] == ["the pixels", "Grad-CAM"]


def test_a_line_spans_the_interval_of_each_score(truth):
    truth["placebos"]["blob"] = {"mean": 0.2, "lower95": -0.1, "upper95": 0.3}
    lines = [list(line.get_xdata()) for line in draw(truth_charts, truth)[0].lines]
    assert lines[:3] == [[0.4, 0.6], [-0.1, 0.3], [0.4, 0.6]]  # placebos below, Grad-CAM on top


def test_each_test_has_a_chart_of_its_own_with_its_bar(truth):
    axes = draw(truth_charts, truth)
    first = [axis.get_title().split("\n")[0] for axis in axes]
    assert first[1:] == [
        "score above its strongest placebo",
        "hits above chance",
        "similarity on shuffled weights",
    ]
    assert [list(axis.lines[-1].get_xdata()) for axis in axes[1:]] == [[0, 0], [0, 0], [0.5, 0.5]]
    assert list(axes[3].lines[0].get_xdata()) == [0.6, 0.8]


def test_the_key_names_each_region_once(truth):
    (axis,) = draw(heat_chart, truth)
    texts = [text.get_text() for text in axis.figure.legends[0].get_texts()]
    assert texts == ["next cube", "other cubes", "drone", "ground", "sky"]


def test_a_map_without_heat_says_so(truth):
    for shares in truth["heat"]["grad_cam"].values():
        shares["share"]["mean"] = 0.0
    (text,) = draw(heat_chart, truth)[0].texts
    assert (text.get_text(), text.get_position()) == ("no heat", (0.5, 1))
