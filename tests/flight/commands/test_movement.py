import math

import pytest
import torch

from drone_rl.flight.commands.command import fly_command
from drone_rl.flight.commands.movement import (
    AngleCommand,
    Height,
    RateCommand,
    RotorCommand,
    Throttle,
)
from drone_rl.sim.dynamics import Mode


def told(command, body):
    command.begin(body)
    return command.goals(body)


def test_angles_with_a_height(hovering):
    goals = told(AngleCommand(0.1, -0.2, Height(3.0), 1.0), hovering((0, 0, 5)))
    assert goals.modes == (Mode.ANGLE, Mode.ANGLE, Mode.ANGLE, Mode.POSITION)
    assert goals.values.tolist() == [[0.1, -0.2, 0.0, 3.0]]


def test_angles_with_a_throttle_and_a_turn(hovering):
    body = hovering((0, 0, 5))
    yaw_control = told(AngleCommand(0.0, 0.0, Throttle(0.6), 1.0, yaw_rate=0.5), body)
    assert yaw_control.modes == (Mode.ANGLE, Mode.ANGLE, Mode.RATE, Mode.THROTTLE)
    assert yaw_control.values.tolist() == [[0.0, 0.0, 0.5, 0.6]]
    assert told(AngleCommand(0.0, 0.0, Throttle(0.6), 1.0, yaw=1.0), body).values[0, 2] == 1.0


def test_a_drone_with_its_nose_down_speeds_up_ahead(quadrotor, hovering):
    """Along x by g tan(pitch), less what drags."""
    command = AngleCommand(0.0, 0.1, Height(5.0), 2.0)
    record = fly_command(quadrotor, hovering((0, 0, 5)), command, 9.0)
    last = record.states[-1]
    assert record.times[-1] <= 2.0
    gained = 9.81 * math.tan(0.1) * record.times[-1].item()
    assert 0.6 * gained < last.velocity[0, 0].item() < gained
    assert abs(last.velocity[0, 1].item()) < 1e-3


def test_rates(quadrotor, hovering):
    command = RateCommand((0.0, 0.0, 1.0), Height(5.0), 1.0)
    last = fly_command(quadrotor, hovering((0, 0, 5)), command, 9.0).states[-1]
    assert last.angular_velocity[0].tolist() == pytest.approx([0, 0, 1], abs=0.05)


def test_rotors_have_no_controller(quadrotor, hovering):
    """Four shares of hover_throttle carry the drone; a tenth of it lets it fall."""
    share = quadrotor.settings.hover_throttle
    still = fly_command(quadrotor, hovering((0, 0, 50)), RotorCommand((share,) * 4, 1.0), 1.0)
    assert still.states[-1].position[0, 2].item() == pytest.approx(50.0, abs=1e-3)
    falling = fly_command(quadrotor, hovering((0, 0, 50)), RotorCommand((0.0,) * 4, 1.0), 1.0)
    fallen = 0.5 * 9.81 * falling.times[-1].item() ** 2
    assert (50.0 - falling.states[-1].position[0, 2]).item() == pytest.approx(fallen, rel=0.1)
    assert torch.equal(told(RotorCommand((0.0, 0.1, 0.2, 0.3), 1.0), hovering((0, 0, 5))).values,
                       torch.tensor([[0.0, 0.1, 0.2, 0.3]], dtype=torch.float64))  # fmt: skip
