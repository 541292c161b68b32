import math

import pytest

from drone_rl.flight.commands.movement import StickCommand, Sticks
from drone_rl.flight.commands.yaw import YawControl, YawMode
from drone_rl.sim.dynamics import Mode
from drone_rl.utils.errors import InputError


def told(sticks, body, **choices):
    command = StickCommand(lambda: sticks, 1.0, vx_max=4.0, vy_max=2.0, z_max=3.0, **choices)
    command.begin(body)
    return command.goals(body)


def test_full_sticks_give_the_greatest_speeds(hovering):
    goals = told(Sticks(pitch=1.0, roll=0.5, throttle=-1.0), hovering((0, 0, 5)))
    assert goals.modes == (Mode.VELOCITY, Mode.VELOCITY, Mode.ANGLE, Mode.POSITION)
    assert goals.values.tolist() == [[4, -1, 0, 2]]


def test_ahead_is_where_it_looked_when_it_began(hovering):
    body = hovering((0, 0, 5))
    body.attitude[0] = body.attitude.new_tensor([math.sqrt(0.5), 0, 0, math.sqrt(0.5)])
    command = StickCommand(lambda: Sticks(pitch=0.5), 1.0, vx_max=4.0, vy_max=2.0, z_max=3.0)
    command.begin(body)
    body.attitude[0] = body.attitude.new_tensor([1, 0, 0, 0])
    assert command.goals(body).values[0].tolist() == pytest.approx([0, 2, math.pi / 2, 5])


def test_the_yaw_stick_adds_to_the_yaw_mode(hovering):
    yaw_control = YawControl("max_degree_of_freedom", YawMode(True, 40.0))
    goals = told(Sticks(yaw=0.1), hovering((0, 0, 5)), yaw_control=yaw_control)
    assert goals.modes[2] == Mode.RATE
    assert goals.values[0, 2].item() == pytest.approx(math.radians(30))


def test_no_goal_is_below_the_ground(hovering):
    assert told(Sticks(throttle=-1.0), hovering((0, 0, 1))).values[0, 3] == 0.0


def test_where_no_stick_stands():
    with pytest.raises(
        InputError, match=r"roll=1\.1 is invalid; give a finite number of -1 or more"
    ):
        Sticks(roll=1.1)


def test_sticks_stand_in_the_middle_by_default():
    sticks = Sticks()
    assert (sticks.pitch, sticks.roll, sticks.throttle, sticks.yaw) == (0.0, 0.0, 0.0, 0.0)
