import math

import pytest

from drone_rl.sim.dynamics import Mode


def goals(pilot):
    """Goals that the running command sets now."""
    return pilot.running.command.goals(pilot.body)


def test_angles_with_a_height(hovering_pilot):
    hovering_pilot.move_by_angle(10, 20, 1.0, z=3.0, wait=False)
    assert goals(hovering_pilot).modes == (Mode.ANGLE, Mode.ANGLE, Mode.ANGLE, Mode.POSITION)
    expected = [math.radians(10), math.radians(-20), 0.0, 3.0]
    assert goals(hovering_pilot).values.tolist() == [expected]


def test_angles_with_a_throttle_and_a_turn(hovering_pilot):
    hovering_pilot.move_by_angle(0, 0, 1.0, throttle=0.6, yaw_rate=-90, wait=False)
    assert goals(hovering_pilot).modes == (Mode.ANGLE, Mode.ANGLE, Mode.RATE, Mode.THROTTLE)
    assert goals(hovering_pilot).values.tolist() == [[0.0, 0.0, math.pi / 2, 0.6]]
    hovering_pilot.move_by_angle(0, 0, 1.0, yaw=-90, wait=False)
    assert goals(hovering_pilot).values.tolist() == [[0.0, 0.0, math.pi / 2, 5.0]]


def test_a_drone_with_its_nose_down_accelerates_forward(hovering_pilot):
    """By g tan(pitch), less the drag."""
    hovering_pilot.move_by_angle(0, -math.degrees(0.1), 2.0)
    x, y, _ = hovering_pilot.state.velocity
    gained = 9.81 * math.tan(0.1) * hovering_pilot.time
    assert 0.6 * gained < x < gained
    assert abs(y) < 1e-3


def test_rates(hovering_pilot):
    hovering_pilot.move_by_rates(1, -2, -3, 1.0, wait=False)
    assert goals(hovering_pilot).modes == (Mode.RATE, Mode.RATE, Mode.RATE, Mode.POSITION)
    assert goals(hovering_pilot).values[0].tolist() == [*map(math.radians, (1, 2, 3)), 5.0]
    hovering_pilot.move_by_rates(0, 0, -90, 1.0)
    turning = hovering_pilot.body.angular_velocity[0].tolist()
    assert turning == pytest.approx([0, 0, math.pi / 2], abs=0.05)


def test_rotors_have_no_controller(hovering_pilot):
    """Hover throttle holds the height; without thrust the drone falls freely."""
    hovering_pilot.move_by_rotors([hovering_pilot.settings.hover_throttle] * 4, 0.5)
    assert hovering_pilot.state.position[2] == pytest.approx(5.0, abs=1e-3)
    began = hovering_pilot.time
    hovering_pilot.move_by_rotors([0.0] * 4, 0.5)
    fallen = 0.5 * 9.81 * (hovering_pilot.time - began) ** 2
    assert 5.0 - hovering_pilot.state.position[2] == pytest.approx(fallen, rel=0.1)
    hovering_pilot.move_by_rotors([0.0, 0.1, 0.2, 0.3], 1.0, wait=False)
    assert goals(hovering_pilot).values.tolist() == [[0.0, 0.1, 0.2, 0.3]]
