import math

import pytest

from drone_rl.flight.commands.command import fly_command
from drone_rl.flight.commands.movement import Frame, RotateToCommand, VelocityCommand, parse_frame
from drone_rl.flight.commands.yaw import YawControl
from drone_rl.sim.dynamics import Mode
from drone_rl.utils.errors import InputError


def test_goals(hovering):
    body = hovering((0, 0, 5))
    climbing = VelocityCommand((1.0, 2.0), 1.0, climb=0.5)
    climbing.begin(body)
    assert climbing.goals(body).modes == (Mode.VELOCITY, Mode.VELOCITY, Mode.ANGLE, Mode.VELOCITY)
    assert climbing.goals(body).values.tolist() == [[1, 2, 0, 0.5]]
    level = VelocityCommand((1.0, 2.0), 1.0, z=7.0, yaw_control=YawControl("forward_only"))
    level.begin(body)
    assert level.goals(body).modes[3] == Mode.POSITION
    assert level.goals(body).values.tolist() == [[1, 2, math.atan2(2, 1), 7]]


def test_it_gets_there_in_the_drones_own_frame(quadrotor, hovering):
    turned = fly_command(
        quadrotor, hovering((0, 0, 5)), RotateToCommand(math.pi / 2, 0.01, 9.0), 9.0
    )
    command = VelocityCommand((2.0, 0.0), 6.0, z=5.0, frame=Frame.BODY)
    last = fly_command(quadrotor, turned.states[-1], command, 9.0).states[-1]
    assert last.velocity[0].tolist() == pytest.approx([0, 2, 0], abs=0.05)


def test_what_does_not_go_together():
    with pytest.raises(InputError, match="frame=body turns with the drone"):
        VelocityCommand((1.0, 0.0), 1.0, frame=Frame.BODY, yaw_control=YawControl("forward_only"))
    with pytest.raises(InputError, match="frame='moon' is unknown; give one of: world, body"):
        parse_frame("moon")
