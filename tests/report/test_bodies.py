"""The table in colours: a row a policy, a column a body."""

from matplotlib.colors import to_hex
from matplotlib.patches import Rectangle

from drone_rl.report.bodies import chart
from tests.words.test_bodies import BAD, GOOD, NUMBERS


def cells(figure):
    return [patch for patch in figure.axes[0].patches if isinstance(patch, Rectangle)]


def test_each_cell_has_the_colour_of_its_verdict():
    boxes = cells(chart(NUMBERS))
    assert [box.get_xy() for box in boxes] == [(0, 0), (1, 0)]
    green, red = (to_hex(box.get_facecolor()) for box in boxes)
    assert (green, red) == ("#b9e0b0", "#f2b5ad")


def test_it_says_verdict_share_interval_and_what_fails():
    said = [text.get_text() for text in chart(NUMBERS).axes[0].texts]
    assert said[:3] == ["computer vision", "wind 8 m/s", "one"]
    assert said[3:] == [
        "good", "97.5%  (95 to 99)", "",
        "poor ?", "10.0%  (7 to 14)", "by ending at the step\nlimit",
    ]  # fmt: skip


def test_it_grows_with_what_there_is():
    more = {"bodies": ["a", "b", "c"], "policies": {}}
    for name in ("one", "two"):
        more["policies"][name] = {"a": GOOD, "b": BAD, "c": {**GOOD, "kind": "none of these"}}
    small, large = chart(NUMBERS), chart(more)
    assert (large.get_size_inches() > small.get_size_inches()).all()
    assert len(cells(large)) == 6
