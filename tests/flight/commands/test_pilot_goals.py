import math

import pytest

from drone_rl.flight.commands.path_following import YawMode
from drone_rl.flight.commands.pilot import Sticks
from drone_rl.utils.errors import InputError


@pytest.fixture
def pilot(hovering_pilot):
    return hovering_pilot


def goals(pilot):
    """Goals that the running command sets now: their modes by name, and values."""
    found = pilot.running.command.goals(pilot.body)
    return " ".join(mode.name.lower() for mode in found.modes), found.values[0].tolist()


def test_angles(pilot):
    pilot.move_by_angle(10, 20, 1.0, z=3.0, wait=False)
    tilt = [math.radians(10), math.radians(-20)]
    assert goals(pilot) == ("angle angle angle position", [*tilt, 0.0, 3.0])
    pilot.move_by_angle(0, 0, 1.0, throttle=0.6, yaw_rate=-90, wait=False)
    assert goals(pilot) == ("angle angle rate throttle", [0.0, 0.0, math.pi / 2, 0.6])
    pilot.move_by_angle(0, 0, 1.0, yaw=-90, wait=False)
    assert goals(pilot)[1] == [0.0, 0.0, math.pi / 2, 5.0]


def test_a_drone_with_its_nose_down_accelerates_forward(pilot):
    """By g tan(pitch), less the drag."""
    pilot.move_by_angle(0, -math.degrees(0.1), 2.0)
    x, y, _ = pilot.state.velocity
    gained = 9.81 * math.tan(0.1) * pilot.time
    assert 0.6 * gained < x < gained
    assert abs(y) < 1e-3


def test_rates(pilot):
    pilot.move_by_rates(1, -2, -3, 1.0, wait=False)
    assert goals(pilot) == ("rate rate rate position", [*map(math.radians, (1, 2, 3)), 5.0])
    pilot.move_by_rates(0, 0, -90, 1.0)
    turning = pilot.body.angular_velocity[0].tolist()
    assert turning == pytest.approx([0, 0, math.pi / 2], abs=0.05)


def test_rotors_have_no_controller(pilot):
    """Hover throttle holds the height; without thrust the drone falls freely."""
    pilot.move_by_rotors([pilot.settings.hover_throttle] * 4, 0.5)
    assert pilot.state.position[2] == pytest.approx(5.0, abs=1e-3)
    began = pilot.time
    pilot.move_by_rotors([0.0] * 4, 0.5)
    fallen = 0.5 * 9.81 * (pilot.time - began) ** 2
    assert 5.0 - pilot.state.position[2] == pytest.approx(fallen, rel=0.1)
    pilot.move_by_rotors([0.0, 0.1, 0.2, 0.3], 1.0, wait=False)
    assert goals(pilot)[1] == [0.0, 0.1, 0.2, 0.3]


def test_velocities(pilot):
    pilot.move_by_velocity(1, 2, 0.5, wait=False)
    assert goals(pilot) == ("velocity velocity angle velocity", [1, 2, 0, 0.5])
    pilot.move_by_velocity(1, 2, z=7, drivetrain="forward_only", wait=False)
    assert goals(pilot) == ("velocity velocity angle position", [1, 2, math.atan2(2, 1), 7])


def test_the_body_frame_turns_with_the_drone(pilot):
    pilot.rotate_to(-90, margin=0.5)
    pilot.move_by_velocity(2, 0, duration=6, z=5, frame="body")
    assert pilot.state.velocity == pytest.approx((0, 2, 0), abs=0.05)
    with pytest.raises(InputError, match="frame=body turns with the drone"):
        pilot.move_by_velocity(1, 0, frame="body", drivetrain="forward_only")


def test_sticks(pilot):
    """Forward is the heading at the start, here to the left; no goal is below the ground."""
    for sticks, heading, mode, expected in (
        (Sticks(pitch=1.0, roll=0.5, throttle=-1.0), 0.0, YawMode(), [4, -1, 0, 2]),
        (Sticks(pitch=0.5), 90.0, YawMode(), [0, 2, math.pi / 2, 5]),
        (Sticks(yaw=0.1), 0.0, YawMode(True, -40.0), [0, 0, math.radians(30), 5]),
    ):
        body, half = pilot.body, math.radians(heading) / 2
        body.attitude[0] = body.attitude.new_tensor([math.cos(half), 0, 0, math.sin(half)])
        pilot.sticks = sticks
        pilot.move_by_manual(4.0, 2.0, 3.0, 1.0, wait=False, yaw_mode=mode)
        assert goals(pilot)[1] == pytest.approx(expected)
    pilot.body.position[0, 2], pilot.sticks = 1.0, Sticks(throttle=-1.0)
    assert goals(pilot)[1][3] == 0.0
    with pytest.raises(InputError, match=r"roll=1\.1 is out of range"):
        Sticks(roll=1.1)
