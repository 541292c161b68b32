"""Terms of reports and displays of actions, as files hold them."""

import pytest

from drone_rl.sim import actions
from drone_rl.sim.vocabulary import (
    MOST,
    SHOWN_MOVES,
    ShownActions,
    TaskVocabulary,
    shipped_vocabulary,
)
from drone_rl.utils.errors import InputError

CUBES = shipped_vocabulary("collect_cubes")


def test_vocabulary_round_trip():
    other = CUBES.replace(goal="post", sides={"near": "close by"})
    assert TaskVocabulary.read(other.as_dict()) == other


@pytest.mark.parametrize(
    ("by", "value", "said"),
    [
        ("cube", "second", "at the second cube"),
        ("sideways", "4 to 6 m", "with cubes 4 to 6 m to its side"),
        ("end", "wall_touched", "by wall touched"),
        ("wind", "strong", "where wind is strong"),
    ],
)
def test_descriptions_of_failures(by, value, said):
    assert CUBES.failing(by, value) == said


@pytest.mark.parametrize(
    "change",
    [ {"goal": "c" * 201}, {"sides": ["left"]},
     {"ends": {str(i): "" for i in range(MOST + 1)}}, ],
)  # fmt: skip
def test_invalid_vocabulary_raises(change):
    with pytest.raises(InputError, match="terms"):
        TaskVocabulary.read({**CUBES.as_dict(), **change}, "terms")


def test_moves_are_the_default_display():
    assert actions.MOVES.shown == SHOWN_MOVES
    assert [SHOWN_MOVES.css(i) for i in range(3)] == ["#cc79a7", "#e69f00", "#0072b2"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"names": ["a", "a", "b"]}, "give 3 different names, and the index of each once"),
        ({"arrows": [[0, 1]]}, "an arrow and a color"),
        ({"colors": [[0, 0, 256]] * 3}, "must be"),
    ],
)
def test_invalid_displays_raise(change, message):
    with pytest.raises(InputError, match=message):
        ShownActions.read({**SHOWN_MOVES.model_dump(), **change})
