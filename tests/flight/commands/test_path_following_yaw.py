import math

import pytest
import torch

from drone_rl.flight.commands.path_following import Drivetrain, YawControl, YawMode
from drone_rl.sim.dynamics import Mode
from drone_rl.utils.errors import InputError

LEFT = torch.tensor([[0.0, 2.0, 5.0]], dtype=torch.float64)


@pytest.fixture
def body(hovering):
    """A drone with a heading of 0.3."""
    found = hovering((0, 0, 5))
    found.attitude[0] = found.attitude.new_tensor([math.cos(0.15), 0, 0, math.sin(0.15)])
    return found


def test_the_heading_is_held_by_default(body):
    yaw_control = YawControl(body)
    assert (yaw_control.mode, yaw_control.goal(LEFT).item()) == (Mode.ANGLE, pytest.approx(0.3))


def test_an_angle_and_a_rate(body):
    angle = YawControl(body, "max_degree_of_freedom", YawMode(False, -90.0))
    assert angle.mode == Mode.ANGLE
    assert angle.goal(LEFT).item() == pytest.approx(math.pi / 2)
    rate = YawControl(body, "max_degree_of_freedom", YawMode(True, 180.0))
    assert (rate.mode, rate.goal(LEFT).item()) == (Mode.RATE, pytest.approx(-math.pi))


def test_forward_only_looks_where_it_goes_and_else_where_it_looked(body):
    yaw_control = YawControl(body, Drivetrain.FORWARD_ONLY, YawMode(False, -45.0))
    up = torch.tensor([[0.0, 0.0, 5.0]], dtype=torch.float64)
    assert yaw_control.goal(up).item() == pytest.approx(0.3)
    assert yaw_control.goal(LEFT).item() == pytest.approx(math.radians(135))
    assert yaw_control.goal(up).item() == pytest.approx(math.radians(135))


def test_what_does_not_go_together(body):
    with pytest.raises(InputError, match="direction of travel; give is_rate=False"):
        YawControl(body, "forward_only", YawMode(True, 10.0))
    with pytest.raises(InputError, match="drivetrain='sideways' is unknown; give forward_only, "):
        YawControl(body, "sideways")
    with pytest.raises(InputError, match=r"yaw_mode=\(False, 9\) is not a YawMode"):
        YawControl(body, "forward_only", (False, 9))
    with pytest.raises(InputError, match="yaw_or_rate=nan"):
        YawMode(False, math.nan)


def test_whether_it_is_a_rate_is_true_or_false():
    with pytest.raises(InputError, match="is_rate='no' is neither true nor false"):
        YawMode(is_rate="no", yaw_or_rate=45)
