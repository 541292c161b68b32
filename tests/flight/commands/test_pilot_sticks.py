import math

import pytest

from drone_rl.flight.commands.path_following import YawMode
from drone_rl.flight.commands.pilot import Sticks
from drone_rl.sim.dynamics import Mode
from drone_rl.utils.errors import InputError


@pytest.fixture
def goals(hovering_pilot):
    """Goals of stick positions."""

    def of(sticks, **choices):
        hovering_pilot.sticks = sticks
        hovering_pilot.move_by_manual(4.0, 2.0, 3.0, 1.0, wait=False, **choices)
        return hovering_pilot.running.command.goals(hovering_pilot.body)

    return of


def test_full_sticks_give_the_greatest_speeds(goals):
    found = goals(Sticks(pitch=1.0, roll=0.5, throttle=-1.0))
    assert found.modes == (Mode.VELOCITY, Mode.VELOCITY, Mode.ANGLE, Mode.POSITION)
    assert found.values.tolist() == [[4, -1, 0, 2]]


def test_forward_is_the_heading_at_the_start(goals, hovering_pilot):
    body = hovering_pilot.body
    body.attitude[0] = body.attitude.new_tensor([math.sqrt(0.5), 0, 0, math.sqrt(0.5)])
    goals(Sticks(pitch=0.5))
    body.attitude[0] = body.attitude.new_tensor([1, 0, 0, 0])
    found = hovering_pilot.running.command.goals(body)
    assert found.values[0].tolist() == pytest.approx([0, 2, math.pi / 2, 5])


def test_the_yaw_stick_adds_to_the_yaw_mode(goals):
    found = goals(Sticks(yaw=0.1), yaw_mode=YawMode(True, -40.0))
    assert found.modes[2] == Mode.RATE
    assert found.values[0, 2].item() == pytest.approx(math.radians(30))


def test_no_goal_is_below_the_ground(goals, hovering_pilot):
    hovering_pilot.body.position[0, 2] = 1.0
    assert goals(Sticks(throttle=-1.0)).values[0, 3] == 0.0


def test_a_stick_out_of_range_is_an_error():
    with pytest.raises(InputError, match=r"roll=1\.1"):
        Sticks(roll=1.1)
