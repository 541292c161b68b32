import pytest

from drone_rl.sim import actions
from drone_rl.sim.continuous_actions import ContinuousActions
from drone_rl.sim.vocabulary import SHOWN_MOVES, shown_actions
from drone_rl.utils.errors import InputError
from tests.continuous import SETTINGS


def test_moves_are_the_default_display():
    display = shown_actions({"actions": actions.MOVES.as_dict()})
    assert display == SHOWN_MOVES == shown_actions({"name": "an older one"})
    assert [SHOWN_MOVES.css(i) for i in range(3)] == ["#cc79a7", "#e69f00", "#0072b2"]


def test_speeds_are_in_meters_and_degrees_per_second():
    velocities = ContinuousActions.of(SETTINGS.replace(forward_speed=5.0, yaw_rate=90.0))
    assert shown_actions({"actions": velocities.as_dict()}).speeds == pytest.approx((5, 3, 90))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"names": ["a", "a", "b"]}, "give 3 different names, and the index of each once"),
        ({"names": ["<b>", "left", "right"]}, "not an action's name; give lower-case letters"),
        ({"names": ["forward", "left"]}, "give 2 different names, and the index of each once"),
        ({"order": [0, 1, 1]}, "order=.*0, 1, 1.* or a name is invalid"),
        ({"order": [0, 1, 99]}, "out of range"),
        ({"arrows": [[0, 1]]}, "an arrow and a color"),
        ({"arrows": [[0, 9]] * 3}, "out of range"),
        ({"colors": [[0, 0, 256]] * 3}, "out of range"),
        ({"colors": "red"}, "does not fit"),
        ({"speeds": [4, 3]}, "does not fit"),
        ({"speeds": [4, -1, 45]}, "out of range"),
        ({"more": 1}, "unknown"),
    ],
)
def test_invalid_displays_raise(change, message):
    with pytest.raises(InputError, match=message):
        shown_actions({"actions": {**actions.MOVES.as_dict(), **change}})
