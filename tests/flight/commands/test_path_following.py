import math

import pytest

from benchmarks.flight_paths import fly_command
from drone_rl.config import DynamicsSettings
from drone_rl.flight.commands.path_following import (
    Drivetrain,
    GoHomeCommand,
    Path,
    PathCommand,
    TakeoffCommand,
    YawControl,
    YawMode,
    braking_time,
    lookahead_of,
)
from drone_rl.sim.dynamics import Mode, Quadrotor
from drone_rl.utils.errors import InputError

CORNER = Path([[0, 0, 1], [4, 0, 1], [4, 3, 1], [4, 3, 1]])
"""Four metres ahead and three to the left; the end is repeated."""


def test_places_and_directions_along_a_path():
    assert CORNER.length == 7.0
    for along, place, direction in (
        (0.0, [0, 0, 1], [1, 0, 0]),
        (3.9, [3.9, 0, 1], [1, 0, 0]),
        (4.0, [4, 0, 1], [0, 1, 0]),  # at a corner the later direction counts
        (5.0, [4, 1, 1], [0, 1, 0]),
        (99.0, [4, 3, 1], [0, 0, 0]),
    ):
        assert CORNER.place_at(along).tolist() == place
        assert CORNER.direction_at(along).tolist() == direction


def test_the_nearest_place_of_a_part():
    """The corner, 4 m along, is nearer to the last position than all of the part from 5 to 6 m."""
    assert CORNER.nearest([3.5, 2, 1]) == 6.0
    assert CORNER.nearest([3.5, 2, 1], 0.0, 3.0) == 3.0
    assert CORNER.nearest([3.5, 2, 1], 5.0, 5.0) == 5.0
    assert CORNER.nearest([4, 0.1, 1], 5.0, 6.0) == 5.0
    there_and_back = Path([[0, 0, 0], [5, 0, 0], [0, 0, 0]])
    assert there_and_back.nearest([2, 0.1, 0], 1.0, 4.0) == 2.0
    assert there_and_back.nearest([2, 0.1, 0], 6.0, 9.0) == 8.0


def test_distances():
    positions = ([2, -1, 1], [-3, -4, 1], [4, 7, 4])
    assert [CORNER.distance_from(position) for position in positions] == [1, 5, 5]


@pytest.fixture
def body(hovering):
    """A drone with a heading of 0.3."""
    found = hovering((0, 0, 5))
    found.attitude[0] = found.attitude.new_tensor([math.cos(0.15), 0, 0, math.sin(0.15)])
    return found


def test_headings(body):
    held = YawControl(body)
    assert (held.mode, held.goal(0.0, 2.0)) == (Mode.ANGLE, pytest.approx(0.3))
    angle = YawControl(body, "max_degree_of_freedom", YawMode(False, -90.0))
    assert (angle.mode, angle.goal(0.0, 2.0)) == (Mode.ANGLE, pytest.approx(math.pi / 2))
    rate = YawControl(body, "max_degree_of_freedom", YawMode(True, 180.0))
    assert (rate.mode, rate.goal(0.0, 2.0)) == (Mode.RATE, pytest.approx(-math.pi))


def test_forward_only_looks_where_it_goes_and_else_where_it_looked(body):
    yaw_control = YawControl(body, Drivetrain.FORWARD_ONLY, YawMode(False, -45.0))
    assert yaw_control.goal(0.0, 0.0) == pytest.approx(0.3)
    assert yaw_control.goal(0.0, 2.0) == pytest.approx(math.radians(135))
    assert yaw_control.goal(0.0, 0.0) == pytest.approx(math.radians(135))


def test_what_does_not_go_together(body):
    with pytest.raises(InputError, match="direction of travel; give is_rate=False"):
        YawControl(body, "forward_only", YawMode(True, 10.0))
    with pytest.raises(InputError, match="drivetrain='sideways': it must be 'forward_only'"):
        YawControl(body, "sideways")
    with pytest.raises(InputError, match=r"yaw_mode=\(False, 9\) is not a YawMode"):
        YawControl(body, "forward_only", (False, 9))
    with pytest.raises(InputError, match="yaw_or_rate=nan"):
        YawMode(False, math.nan)
    with pytest.raises(InputError, match="is_rate='no'"):
        YawMode(is_rate="no", yaw_or_rate=45)


def test_over_its_home_first_and_down_then(quadrotor, hovering):
    body = hovering((5, 0, 1.5))
    command = GoHomeCommand(PathCommand(body, [(0.0, 0.0, 1.5)], 2.0, 20.0), 20.0)
    assert command.limit == 40.0
    states, done = fly_command(quadrotor, body, command)
    assert done == len(states) - 1
    places = [state.position[0].tolist() for state in states]
    assert max(x for x, _, z in places if z < 1.4) < 0.5
    assert places[-1] == pytest.approx((0.0, 0.0, 0.3), abs=0.05)


@pytest.mark.parametrize("wind", [0.0, 5.0])
def test_two_metres_up_whatever_the_wind(wind, hovering):
    body = hovering((1, 2, 0.3))
    air = Quadrotor(DynamicsSettings(mode="simple_flight", wind=(wind, 0.0, 0.0)))
    states, done = fly_command(air, body, TakeoffCommand(body, 20.0))
    assert 3.8 < done * 0.021 < 6.0  # 1.9 m at 0.5 m/s, and braking
    assert states[-1].position[0, 2].item() == pytest.approx(2.2, abs=0.02)


def test_lookahead():
    assert lookahead_of(2.0) == pytest.approx(1.2)
    assert lookahead_of(2.0, adaptive=0.0) == pytest.approx(1.6)
    assert lookahead_of(0.5) == 0.75
    assert lookahead_of(2.0, 3.0) == 3.0
    with pytest.raises(InputError, match=r"lookahead=0\.9 is too short at 50 m/s; give at least 1"):
        lookahead_of(50.0, 0.9)


def test_braking_takes_twice_the_time_constant_of_the_speed():
    """A metre a second that is missing tilts by 0.2 * pi / 5.5, which pulls 9.81 times as much."""
    settings = DynamicsSettings()
    assert braking_time(settings) == pytest.approx(2 / (9.81 * 0.2 * math.pi / 5.5))
    assert braking_time(settings.replace(velocity_gain=0.0)) == 20.0


def test_the_carrot_is_a_lookahead_away(hovering):
    body = hovering((0, 0, 5))
    command = PathCommand(body, [[10, 0, 5]], 2.0, 60.0)
    body.position[0, 1] = 0.9
    goals = command.goals(body)
    assert goals.modes == (Mode.VELOCITY, Mode.VELOCITY, Mode.ANGLE, Mode.POSITION)
    ahead = 1.2 + 0.9  # what it is off the path comes on top
    share = 2.0 / math.hypot(ahead, 0.9)
    assert goals.values[0].tolist() == pytest.approx([share * ahead, -share * 0.9, 0.0, 5.0])
    assert command.along == 0.0


def test_it_climbs_at_the_speed_of_the_path_and_slower_towards_the_end(hovering):
    """Half a second's way from the end on: 0.4 m before it at 0.8 m/s."""
    body = hovering((0, 0, 5))
    goals = PathCommand(body, [[3, 0, 9]], 2.0, 60.0).goals(body)
    assert goals.drift[0].tolist() == pytest.approx([0, 0, 0, 1.6])
    assert goals.values[0].tolist() == pytest.approx([1.2, 0, 0, 5])
    command, climbs = PathCommand(body, [[0, 0, 9], [0, 0, 9]], 2.0, 60.0), []
    for height in (6.0, 7.0, 8.0, 8.6, 9.0):
        body.position[0, 2] = height
        climbs.append(command.goals(body).drifts[0, 3].item())
    assert climbs == pytest.approx([2.0, 2.0, 2.0, 0.8, 0.0], abs=1e-9)


@pytest.mark.parametrize(
    ("end", "speed", "pace"),
    [
        ([[1, 0, 5], [2, 0, 5]], 4.0, 1.0),
        ([[1, 0, 5], [9, 0, 5]], 4.0, 4.0),  # for the end alone
        ([[0.8, 0, 5]], 4.0, 0.6),  # never so much that wind stops it
        ([[0.8, 0, 5]], 0.3, 0.3),
    ],
)
def test_it_brakes_for_the_end(hovering, end, speed, pace):
    body = hovering((0, 0, 5))
    command = PathCommand(body, end, speed, 60.0, braking=2.0)
    assert command.goals(body).values[0, 0].item() == pytest.approx(pace)
    assert not command.is_complete(body)


def test_a_flight_to_the_left_that_faces_its_direction(quadrotor, hovering):
    body = hovering((0, 3, 5))
    yaw_control = YawControl(body, Drivetrain.FORWARD_ONLY, YawMode(False, 0.0))
    command = PathCommand(body, [[0, 9, 7]], 2.0, 60.0, yaw_control=yaw_control)
    states, done = fly_command(quadrotor, body, command)
    assert done * 0.021 < 8.0
    assert states[-1].position[0].tolist() == pytest.approx([0, 9, 7], abs=0.5)
    assert command.rest(states[-1]) == pytest.approx([0, 9, math.pi / 2, 7], abs=0.05)
    assert states[-1].heading.item() == pytest.approx(math.pi / 2, abs=0.1)
