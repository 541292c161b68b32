import pytest

from drone_rl.sim import actions
from drone_rl.sim.continuous_actions import ContinuousActions
from drone_rl.sim.vocabulary import SHOWN_MOVES, shown_actions
from drone_rl.utils.errors import InputError
from tests.continuous import SETTINGS


def test_the_moves_are_those_of_the_simulator_also_in_files_that_say_nothing():
    told = shown_actions({"actions": actions.MOVES.as_dict()})
    assert told == SHOWN_MOVES == shown_actions({"name": "an older one"})
    assert [SHOWN_MOVES.css(i) for i in range(3)] == ["#d62728", "#2ca02c", "#1f60c8"]


def test_speeds_are_told_in_metres_and_degrees_a_second():
    velocities = ContinuousActions.of(SETTINGS.replace(forward_speed=5.0, yaw_rate=90.0))
    assert shown_actions({"actions": velocities.as_dict()}).speeds == pytest.approx((5, 3, 90))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"names": ["a", "a", "b"]}, "not all there"),
        ({"names": ["<b>", "left", "right"]}, "no action's name"),
        ({"names": ["forward", "left"]}, "not all there"),
        ({"order": [0, 1, 1]}, "not all there"),
        ({"order": [0, 1, 99]}, "out of range"),
        ({"arrows": [[0, 1]]}, "an arrow and a colour"),
        ({"arrows": [[0, 9]] * 3}, "out of range"),
        ({"colors": [[0, 0, 256]] * 3}, "out of range"),
        ({"colors": "red"}, "out of range"),
        ({"speeds": [4, 3]}, "out of range"),
        ({"speeds": [4, -1, 45]}, "out of range"),
        ({"more": 1}, "unknown"),
    ],
)
def test_what_a_page_could_not_show_is_refused(change, message):
    with pytest.raises(InputError, match=message):
        shown_actions({"actions": {**actions.MOVES.as_dict(), **change}})
