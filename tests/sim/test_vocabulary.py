import dataclasses

import pytest

from drone_rl.sim.vocabulary import CUBES, MOST, some_cubes, terms_of
from drone_rl.utils.errors import InputError


def test_vocabulary_round_trip_and_default():
    assert terms_of({}) == CUBES
    other = dataclasses.replace(CUBES, goal="post", sides={"near": "close by"})
    assert terms_of({"terms": other.as_dict()}) == other


@pytest.mark.parametrize(
    ("count", "words"), [(1, "one cube"), (2, "two cubes"), (4, "four cubes"), (5, "five cubes"),
    (6, "6 cubes")],
)  # fmt: skip
def test_cubes_are_counted_in_words(count, words):
    task = {"num_cubes": count, "cube_size": 2.5, "lateral_bound": 6.0, "vertical_bound": 0.0}
    assert some_cubes(task) == f"{words} of 2.5 m, up to 6 m to either side and 0 m up or down"


def test_phrases():
    assert (CUBES.goals, CUBES.targets, CUBES.reaches, CUBES.handles) == (
        "cubes", "cubes", "collects", "collects the cube",
    )  # fmt: skip
    assert dataclasses.replace(CUBES, reach="reach").reaches == "reaches"
    assert dataclasses.replace(CUBES, reach="fly", handle="dodge").reaches == "flies"
    assert dataclasses.replace(CUBES, reach="play", handle="dodge").reaches == "plays"
    assert dataclasses.replace(CUBES, reach="fly through").reaches == "flies through"
    assert dataclasses.replace(CUBES, handle="dodge").handles == "dodges"
    assert CUBES.side("left") == "on its left" and CUBES.side("above") == "above"
    assert CUBES.place("right") == "on its right" and CUBES.label("row") == "row"
    assert CUBES.ending("step_limit") == "at the step limit"
    assert CUBES.ending("wall_touched") == "by wall touched"


@pytest.mark.parametrize(
    ("by", "value", "said"),
    [
        ("cube", "second", "at the second cube"),
        ("side", "left", "with cubes on its left"),
        ("sideways", "4 to 6 m", "with cubes 4 to 6 m to its side"),
        ("height", "lower", "with cubes lower than its start"),
        ("end", "side_boundary", "by ending outside the field, left or right"),
        ("end", "wall_touched", "by wall touched"),
        ("wind", "strong", "where wind is strong"),
    ],
)
def test_descriptions_of_failures(by, value, said):
    assert CUBES.failing(by, value) == said


@pytest.mark.parametrize(
    "change",
    [{"goal": 3}, {"goal": "c" * 201}, {"sides": ["left"]}, {"follows": 1}, {"extra": ""},
     {"ends": {str(i): "" for i in range(MOST + 1)}}, {"goal": "a\nb"}],
)  # fmt: skip
def test_invalid_vocabulary_raises(change):
    with pytest.raises(InputError, match="terms"):
        terms_of({"terms": {**CUBES.as_dict(), **change}})
