import math

import pytest
import torch

from benchmarks.flight_paths import fly_command
from drone_rl.config import DynamicsSettings
from drone_rl.flight.commands import path_following as of
from drone_rl.flight.commands.path_following import (
    Drivetrain,
    GoHomeCommand,
    PathCommand,
    TakeoffCommand,
    YawControl,
    YawMode,
)
from drone_rl.sim.dynamics import Mode, Quadrotor
from drone_rl.utils.errors import InputError


def rows(*values):
    return torch.tensor(values, dtype=torch.float64)


CORNER = rows([[0, 0, 1], [4, 0, 1], [4, 3, 1]], [[0, 0, 0], [0, 0, 2], [0, 0, 2]])
"""Four metres ahead and three to the left; two metres up, the end of which is repeated."""


@pytest.fixture
def paths():
    return of.make_paths(CORNER)


def test_lengths_and_directions(paths):
    assert paths.along.tolist() == [[0, 4, 7], [0, 2, 2]]
    assert paths.lengths.tolist() == [7, 2]
    assert paths.directions.tolist() == [[[1, 0, 0], [0, 1, 0]], [[0, 0, 1], [0, 0, 0]]]
    assert paths.ends.tolist() == [[4, 3, 1], [0, 0, 2]]


def test_places_along(paths):
    assert of.place_at(paths, rows(5, 1.5)).tolist() == [[4, 1, 1], [0, 0, 1.5]]
    assert of.place_at(paths, rows(0, 9)).tolist() == [[0, 0, 1], [0, 0, 2]]
    assert of.place_at(paths, rows(99, 2)).tolist() == [[4, 3, 1], [0, 0, 2]]


def test_of_a_corner_the_later_direction_counts(paths):
    assert of.direction_at(paths, rows(4, 0)).tolist() == [[0, 1, 0], [0, 0, 1]]
    assert of.direction_at(paths, rows(3.9, 1)).tolist() == [[1, 0, 0], [0, 0, 1]]


def test_the_nearest_place_of_a_part(paths):
    position = rows([3.5, 2, 1], [1, 1, 1.25])
    whole = of.nearest(paths, position, rows(0, 0), paths.lengths)
    assert whole.tolist() == [6, 1.25]
    part = of.nearest(paths, position, rows(0, 1.5), rows(3, 2))
    assert part.tolist() == [3, 1.5]
    point = of.nearest(paths, position, rows(5, 2), rows(5, 2))
    assert point.tolist() == [5, 2]


def test_the_nearest_place_is_never_outside_the_part(paths):
    """The corner, 4 m along, is nearer than all of the part from 5 m to 6 m."""
    position = rows([4, 0.1, 1], [0, 0, 0])
    assert of.nearest(paths, position, rows(5, 1), rows(6, 2)).tolist() == [5, 1]


def test_a_part_keeps_to_one_way_through_a_crossing():
    """There and back again: the same place is 2 m and 8 m along."""
    paths = of.make_paths(rows([[0, 0, 0], [5, 0, 0], [0, 0, 0]]))
    position = rows([2, 0.1, 0])
    assert of.nearest(paths, position, rows(1), rows(4)).tolist() == [2]
    assert of.nearest(paths, position, rows(6), rows(9)).tolist() == [8]


def test_distances(paths):
    assert of.distance_from(paths, rows([2, -1, 1], [3, 4, 1])).tolist() == [1, 5]
    assert of.distance_from(paths, rows([-3, -4, 1], [0, 3, 6])).tolist() == [5, 5]


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
    with pytest.raises(InputError, match="drivetrain='sideways': it must be 'forward_only'"):
        YawControl(body, "sideways")
    with pytest.raises(InputError, match=r"yaw_mode=\(False, 9\) is not a YawMode"):
        YawControl(body, "forward_only", (False, 9))
    with pytest.raises(InputError, match="yaw_or_rate=nan"):
        YawMode(False, math.nan)


def test_whether_it_is_a_rate_is_true_or_false():
    with pytest.raises(InputError, match="is_rate='no': it must be true or false"):
        YawMode(is_rate="no", yaw_or_rate=45)


def test_over_its_home_first_and_down_then(quadrotor, hovering):
    home = torch.tensor([[[0.0, 0.0, 1.5]]], dtype=torch.float64)
    body = hovering((5, 0, 1.5))
    command = GoHomeCommand(PathCommand(body, home, 2.0, 20.0), 20.0)
    assert command.limit == 40.0
    states, done = fly_command(quadrotor, body, command)
    x, _, z = torch.cat([state.position for state in states]).unbind(-1)
    assert done.item() == len(states) - 1
    assert x[z < 1.4].max() < 0.5
    assert (states[-1].position - home[0] + torch.tensor([0, 0, 1.2])).norm() < 0.05


@pytest.mark.parametrize("wind", [0.0, 5.0])
def test_two_metres_up_whatever_the_wind(wind, hovering):
    body = hovering((1, 2, 0.3))
    air = Quadrotor(DynamicsSettings(mode="simple_flight", wind=(wind, 0.0, 0.0)))
    states, done = fly_command(air, body, TakeoffCommand(body, 20.0))
    assert 3.8 < done.item() * 0.021 < 6.0  # 1.9 m at 0.5 m/s, and braking
    assert states[-1].position[0, 2].item() == pytest.approx(2.2, abs=0.02)
