import math

import pytest

from drone_rl.flight.commands.command import PilotError
from drone_rl.flight.commands.path_following import YawMode
from drone_rl.flight.commands.pilot import Pilot, Sticks
from drone_rl.utils.errors import InputError


def test_by_angle(flying):
    assert flying.move_by_angle(0, -5, 1) is True
    assert flying.state.attitude.pitch == pytest.approx(-5, abs=0.2)
    assert flying.state.velocity[0] > 0.5
    flying.move_by_angle(5, 0, 1, throttle=0.6, yaw_rate=30)
    assert flying.state.attitude.roll == pytest.approx(5, abs=0.2)
    assert flying.state.velocity[1] < -0.5


def test_by_rates_and_rotors(flying):
    assert flying.move_by_rates(0, 0, 45, 1) is True
    assert flying.state.attitude.yaw > 20
    height = flying.state.position[2]
    assert flying.move_by_rotors([0.9] * 4, 0.3) is True
    assert flying.state.position[2] > height


def test_by_velocity(flying):
    assert flying.move_by_velocity(0, 2, 0, 5, z=4) is True
    assert flying.state.velocity == pytest.approx((0, 2, 0), abs=0.1)
    assert flying.state.position[2] == pytest.approx(4, abs=0.1)
    flying.move_by_velocity(0, 0, 1, 2)
    assert flying.state.velocity[2] == pytest.approx(1, abs=0.05)


def test_along_a_path_whose_end_is_held(flying):
    assert flying.move_along([(2, 0, 2), (2, 3, 3)], speed=1) is True
    assert math.dist(flying.state.position, (2, 3, 3)) <= 0.5
    flying.advance(5.0)
    assert flying.state.position == pytest.approx((2, 3, 3), abs=0.05)


def test_to_a_place_and_to_a_height(flying):
    assert flying.move_to(3, 0, 2, speed=2, drivetrain="forward_only") is True
    assert flying.move_to_z(4) is True
    flying.advance(5.0)
    assert flying.state.position[2] == pytest.approx(4, abs=0.02)


def test_a_timeout(flying):
    before = flying.time
    assert flying.move_to(100, 0, 2, timeout=0.5) is False
    assert flying.time == pytest.approx(before + 0.504)


def test_turning(flying):
    assert flying.rotate_to(-90, margin=1) is True
    assert flying.state.attitude.yaw == pytest.approx(-90, abs=1)
    assert flying.rotate_by(90, 1) is True
    assert flying.state.attitude.yaw > -40
    assert flying.rotate_to(90, timeout=0.1) is False


def test_sticks_are_read_while_time_passes(flying):
    flight = flying.move_by_manual(4, 4, 1, 4, wait=False)
    flying.sticks = Sticks(pitch=0.5)
    flying.advance(2.0)
    assert flying.state.velocity[0] > 1.5
    flying.sticks = Sticks(roll=0.5)
    assert flight.result() is True
    assert flying.state.velocity[1] < -1.0


@pytest.mark.parametrize(
    ("name", "given", "choices", "told"),
    [
        ("move_along", ([],), {}, "path has no points"),
        ("move_along", ([(0, 0, math.nan)],), {}, "nan"),
        ("move_to", (1, 2, -3), {}, "below the ground"),
        ("move_to", (1, 2, 3), {"speed": 0}, "speed=0"),
        ("move_to", (1, 2, 3), {"speed": -1}, "speed=-1"),
        ("move_to", (1, 2, 3), {"lookahead": 0}, "lookahead=0 is too short"),
        ("move_to", (1, 2, 3), {"adaptive_lookahead": math.nan}, "adaptive_lookahead=nan"),
        ("move_to", (1, 2, 3), {"timeout": -1}, "timeout=-1"),
        (
            "move_to",
            (1, 2, 3),
            {"drivetrain": "forward_only", "yaw_mode": YawMode(True, 5)},
            "turns at a rate",
        ),
        ("move_by_velocity", (math.inf, 0), {}, "vx=inf"),
        ("move_by_velocity", (1, 0), {"duration": -1}, "duration=-1"),
        ("move_by_velocity", (1, 0, 1), {"z": 3}, "z=3 and vz=1 are both given"),
        ("move_by_velocity", (1, 0), {"frame": "moon"}, "frame='moon'"),
        ("move_by_angle", (91, 0, 1), {}, "roll=91"),
        ("move_by_angle", (0, 0, 1), {"z": 3, "throttle": 0.5}, "z=3 and throttle=0.5"),
        ("move_by_angle", (0, 0, 1), {"yaw": 3, "yaw_rate": 2}, "yaw=3 and yaw_rate=2"),
        ("move_by_angle", (0, 0, 1), {"throttle": 1.5}, "throttle=1.5"),
        ("move_by_rates", (0, math.nan, 0, 1), {}, "pitch=nan"),
        ("move_by_rotors", ([0.5] * 3, 1), {}, "give 4 numbers"),
        ("move_by_rotors", ([0.5, 0.5, 2, 0.5], 1), {}, r"shares\[2\]=2"),
        ("rotate_to", (math.nan,), {}, "yaw=nan"),
        ("rotate_to", (9,), {"margin": 0}, "margin=0"),
        ("rotate_to", (9,), {"timeout": -1}, "timeout=-1"),
        ("rotate_by", (9, -1), {}, "duration=-1"),
        ("move_by_manual", (0, 1, 1, 1), {}, "vx_max=0"),
        ("move_by_manual", (1, 1, -1, 1), {}, "z_max=-1 is invalid; give a finite number of 0"),
    ],
)
def test_what_is_refused_before_anything_moves(flying, name, given, choices, told):
    before = flying.time
    with pytest.raises(InputError, match=told) as error:
        getattr(flying, name)(*given, **choices)
    assert not isinstance(error.value, PilotError)
    assert "\n" not in str(error.value)
    assert flying.time == before


def test_nothing_moves_before_it_has_taken_off():
    pilot = Pilot()
    pilot.arm()
    with pytest.raises(PilotError, match="move_along: the drone is on the ground"):
        pilot.move_to(1, 2, 3)
