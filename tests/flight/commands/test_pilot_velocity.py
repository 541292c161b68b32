import math

import pytest
import torch

from drone_rl.flight.commands.pilot import Pilot
from drone_rl.flight.commands.state import LandedState
from drone_rl.sim.dynamics import Mode, Obstacles
from drone_rl.utils.errors import InputError


def goals(pilot):
    """Goals that the running command sets now."""
    return pilot.running.command.goals(pilot.body)


def test_goals(hovering_pilot):
    hovering_pilot.move_by_velocity(1, 2, 0.5, wait=False)
    climbing = goals(hovering_pilot)
    assert climbing.modes == (Mode.VELOCITY, Mode.VELOCITY, Mode.ANGLE, Mode.VELOCITY)
    assert climbing.values.tolist() == [[1, 2, 0, 0.5]]
    hovering_pilot.move_by_velocity(1, 2, z=7, drivetrain="forward_only", wait=False)
    assert goals(hovering_pilot).modes[3] == Mode.POSITION
    assert goals(hovering_pilot).values.tolist() == [[1, 2, math.atan2(2, 1), 7]]


def test_the_body_frame_turns_with_the_drone(hovering_pilot):
    hovering_pilot.rotate_to(-90, margin=0.5)
    hovering_pilot.move_by_velocity(2, 0, duration=6, z=5, frame="body")
    assert hovering_pilot.state.velocity == pytest.approx((0, 2, 0), abs=0.05)


def test_a_body_frame_and_forward_only_are_incompatible(hovering_pilot):
    with pytest.raises(InputError, match="frame=body turns with the drone"):
        hovering_pilot.move_by_velocity(1, 0, frame="body", drivetrain="forward_only")
    with pytest.raises(InputError, match="frame='moon': it must be 'world' or 'body'"):
        hovering_pilot.move_by_velocity(1, 0, frame="moon")


def test_obstacles_stop_the_drone(quadrotor, hovering):
    """Half a metre of wall and a radius of 0.3 m in front of 2 m."""
    wall = Obstacles(torch.tensor([[[2.0, 0.0, 5.0]]], dtype=torch.float64), (0.5, 5.0, 5.0))
    pilot = Pilot(quadrotor, obstacles=wall)
    pilot.body, pilot._is_armed, pilot._landed = hovering((0, 0, 5)), True, LandedState.FLYING
    pilot.move_by_velocity(3, 0, duration=1.5, z=5)
    assert 1.0 < pilot.trajectory.positions[:, 0].max() <= 1.2 + 1e-5
