import math

import pytest
import torch

from benchmarks.flight_paths import fly_command
from drone_rl.config import DynamicsSettings
from drone_rl.flight.commands.path_following import (
    Drivetrain,
    PathCommand,
    YawControl,
    YawMode,
    braking_time,
    lookahead_of,
)
from drone_rl.sim.dynamics import Mode
from drone_rl.utils.errors import InputError


def rows(*values):
    return torch.tensor(values, dtype=torch.float64)


def test_a_repeated_last_point_does_not_change_the_braking(hovering):
    body, level, up = hovering((0, 0, 1)), [8.0, 0.0, 1.0], [0.0, 0.0, 9.0]
    for point, braking in ((level, 1.8), (up, 0.5)):
        for points in ([point], [point, point]):
            assert PathCommand(body, rows(points), 2.0, 60.0).braking.tolist() == [braking]


def test_automatic_lookahead():
    assert lookahead_of(2.0) == pytest.approx(1.2)
    assert lookahead_of(2.0, adaptive=0.0) == pytest.approx(1.6)
    assert lookahead_of(0.5) == 0.75
    assert lookahead_of(2.0, 3.0) == 3.0


@pytest.mark.parametrize(("speed", "ahead", "least"), [(1.0, 0.0, "0.5"), (50.0, 0.9, "1")])
def test_a_lookahead_that_leads_nowhere(speed, ahead, least):
    with pytest.raises(InputError, match=f"lookahead={ahead:g} is too short.*at least {least}, or"):
        lookahead_of(speed, ahead)


def test_braking_takes_twice_the_time_constant_of_the_speed():
    """A metre a second that is missing tilts by 0.2 * pi / 5.5, which pulls 9.81 times as much."""
    settings = DynamicsSettings()
    assert braking_time(settings) == pytest.approx(2 / (9.81 * 0.2 * math.pi / 5.5))
    assert braking_time(settings.replace(velocity_gain=0.0)) == 20.0


def test_the_carrot_is_a_lookahead_away(hovering):
    body = hovering((0, 0, 5))
    command = PathCommand(body, rows([[10, 0, 5]]), 2.0, 60.0)
    body.position[0, 1] = 0.9
    goals = command.goals(body)
    assert goals.modes == (Mode.VELOCITY, Mode.VELOCITY, Mode.ANGLE, Mode.POSITION)
    ahead = 1.2 + 0.9  # what it is off the path comes on top
    share = 2.0 / math.hypot(ahead, 0.9)
    assert goals.values[0].tolist() == pytest.approx([share * ahead, -share * 0.9, 0.0, 5.0])
    assert command.along.tolist() == [0.0]


def test_it_climbs_at_the_speed_of_the_path(hovering):
    body = hovering((0, 0, 5))
    command = PathCommand(body, rows([[3, 0, 9]]), 2.0, 60.0)
    goals = command.goals(body)
    assert goals.drift[0].tolist() == pytest.approx([0, 0, 0, 1.6])
    assert goals.values[0].tolist() == pytest.approx([1.2, 0, 0, 5])


def test_it_brakes_for_the_end_alone(hovering):
    body = hovering((0, 0, 5), (0, 0, 5))
    points = rows([[1, 0, 5], [2, 0, 5]], [[1, 0, 5], [9, 0, 5]])
    command = PathCommand(body, points, 4.0, 60.0, braking=2.0)
    assert command.goals(body).values[:, 0].tolist() == pytest.approx([1.0, 4.0])


def test_it_never_brakes_so_much_that_wind_stops_it(hovering):
    body = hovering((0, 0, 5), (0, 0, 5))
    command = PathCommand(
        body, rows([[0.8, 0, 5]], [[0.8, 0, 5]]), rows(4.0, 0.3), 60.0, braking=2.0
    )
    assert command.goals(body).values[:, 0].tolist() == pytest.approx([0.6, 0.3])


def test_drones_of_a_batch_fly_paths_of_their_own_at_speeds_of_their_own(quadrotor, hovering):
    body = hovering((0, 0, 5), (0, 3, 5))
    yaw_control = YawControl(body, Drivetrain.FORWARD_ONLY, YawMode(False, 0.0))
    points, speeds = rows([[8, 0, 5]], [[0, 9, 7]]), rows(1.0, 2.0)
    command = PathCommand(body, points, speeds, 60.0, yaw_control=yaw_control)
    states, done = fly_command(quadrotor, body, command)
    assert done[1] < done[0] < 13.0 / 0.021
    last = states[-1]
    assert (last.position - rows([8, 0, 5], [0, 9, 7])).norm(dim=-1).max() < 0.5
    assert command.rest(last)[:, :2].tolist() == [[8, 0], [0, 9]]
    assert command.rest(last)[:, 2].tolist() == pytest.approx([0, math.pi / 2], abs=0.05)
    assert last.heading.tolist() == pytest.approx([0, math.pi / 2], abs=0.1)


def test_it_is_done_at_the_last_point_not_at_one_on_the_way(hovering):
    body = hovering((0, 0, 5))
    command = PathCommand(body, rows([[5, 0, 5], [0.2, 0, 5]]), 1.0, 60.0)
    command.goals(body)
    assert command.is_complete(body).tolist() == [False]


def test_it_climbs_slower_towards_the_end(hovering):
    """Half a second's way from the end on: 0.4 m before it at 0.8 m/s."""
    body = hovering((0, 0, 5))
    command = PathCommand(body, rows([[0, 0, 9]]), 2.0, 60.0)
    climbs = []
    for height in (6.0, 7.0, 8.0, 8.6, 9.0):
        body.position[0, 2] = height
        climbs.append(command.goals(body).drift[0, 3].item())
    assert climbs == pytest.approx([2.0, 2.0, 2.0, 0.8, 0.0], abs=1e-9)
