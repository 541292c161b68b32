import math

import pytest
import torch

from drone_rl.flight.commands.yaw import Drivetrain, YawControl, YawMode, parse_drivetrain
from drone_rl.sim.dynamics import Mode
from drone_rl.utils.errors import InputError

NOW = torch.tensor([0.3], dtype=torch.float64)
LEFT = torch.tensor([[0.0, 2.0, 5.0]], dtype=torch.float64)


def begun(*args):
    yaw_control = YawControl(*args)
    yaw_control.begin(NOW)
    return yaw_control


def test_the_heading_is_held_by_default():
    yaw_control = begun()
    assert (yaw_control.mode, yaw_control.goal(LEFT, 0.5).item()) == (Mode.ANGLE, 0.3)


def test_an_angle_and_a_rate():
    angle = begun("max_degree_of_freedom", YawMode(False, 90.0))
    assert angle.mode == Mode.ANGLE
    assert angle.goal(LEFT, 0.5).item() == pytest.approx(math.pi / 2)
    rate = begun("max_degree_of_freedom", YawMode(True, -180.0))
    assert (rate.mode, rate.goal(LEFT, 0.5).item()) == (Mode.RATE, pytest.approx(-math.pi))


def test_forward_only_looks_where_it_goes_and_else_where_it_looked():
    yaw_control = begun(Drivetrain.FORWARD_ONLY, YawMode(False, 45.0))
    up = torch.tensor([[0.0, 0.0, 5.0]], dtype=torch.float64)
    assert yaw_control.goal(up, 0.5).item() == 0.3
    assert yaw_control.goal(LEFT, 0.5).item() == pytest.approx(math.radians(135))
    assert yaw_control.goal(up, 0.5).item() == pytest.approx(math.radians(135))


def test_what_does_not_go_together():
    with pytest.raises(InputError, match="direction of travel; give is_rate=False"):
        YawControl("forward_only", YawMode(True, 10.0))
    with pytest.raises(InputError, match="drivetrain='sideways' is unknown; give one of: forward_"):
        parse_drivetrain("sideways")
    with pytest.raises(InputError, match=r"yaw_mode=\(False, 9\) is not a YawMode"):
        YawControl("forward_only", (False, 9))
    with pytest.raises(InputError, match="yaw_or_rate=nan"):
        YawMode(False, math.nan)
