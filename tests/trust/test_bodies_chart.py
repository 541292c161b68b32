"""The table in colors: a row a policy, a column a body."""

from matplotlib.colors import to_hex
from matplotlib.patches import Rectangle

from drone_rl.trust.bodies import LOOPED, chart
from drone_rl.utils import palette
from tests.trust.test_bodies_text import BAD, GOOD, NUMBERS


def cells(figure):
    return [patch for patch in figure.axes[0].patches if isinstance(patch, Rectangle)]


def test_each_cell_has_the_color_of_its_verdict():
    boxes = cells(chart(NUMBERS))
    assert [box.get_xy() for box in boxes] == [(0, 0), (1, 0)]
    assert [box.get_hatch() for box in boxes] == [None, "//"]  # the second is not certain
    green, red = (to_hex(box.get_facecolor()) for box in boxes)
    assert (green, red) == (*(palette.css(palette.light(c)) for c in (palette.GOOD, palette.BAD)),)


def test_it_says_verdict_share_interval_and_what_fails():
    said = [text.get_text() for text in chart(NUMBERS).axes[0].texts]
    assert said[:3] == ["computer vision", "wind 8 m/s", "one"]
    assert said[3:] == [
        "good", "97.5%", "95.4 to 98.8", "",
        "poor ?", "10.0%", "7.0 to 14.0", "by ending at the step\nlimit",
    ]  # fmt: skip


def test_it_grows_with_what_there_is():
    more = {"bodies": ["a", "b", "c"], "policies": {}}
    for name in ("one", "two"):
        more["policies"][name] = {"a": GOOD, "b": BAD, "c": {**GOOD, "kind": "none of these"}}
    small, large = chart(NUMBERS), chart(more)
    assert (large.get_size_inches() > small.get_size_inches()).all()
    assert len(cells(large)) == 6


def test_where_words_stand_and_how_large_the_chart_is():
    figure = chart({**NUMBERS, "policies": {"one": NUMBERS["policies"]["one"]} | {"two": {
        "computer vision": BAD, "wind 8 m/s": GOOD}}})  # fmt: skip
    assert figure.get_size_inches().tolist() == [1.35 * 3, 1.1 * 2 + 0.9]
    places = {text.get_text(): text.get_position() for text in figure.axes[0].texts}
    assert places["one"] == (-0.05, 0.5) and places["two"] == (-0.05, 1.5)
    assert places["computer vision"] == (0.5, -0.25)
    second = [text.get_position() for text in figure.axes[0].texts if text.get_text() == "good"]
    assert second == [(0.5, 0.17), (1.5, 1.17)]


def test_flights_under_a_firmware_are_the_last_column():
    flown = {"success": {"successes": 3, "trials": 14, "lower95": 0.194, "upper95": 0.994}}
    figure = chart({**NUMBERS, LOOPED: {"one": flown}})
    last = figure.axes[0].texts[-1]
    assert last.get_position() == (2.5, 0.5)
    assert last.get_text() == "no verdict: 3 of\n14 (19.4 to\n99.4%)"  # 17 letters a line
    assert cells(figure)[-1].get_xy() == (2, 0) and cells(figure)[-1].get_hatch() == ".."
