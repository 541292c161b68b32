import math

import pytest
import torch

from drone_rl.flight.commands.command import fly_command
from drone_rl.flight.commands.movement import Hover, RotateByCommand, RotateToCommand


def test_hovering_comes_back(quadrotor, hovering):
    body = hovering((1, 2, 5))
    body.velocity[0, 0] = 1.0
    record = fly_command(quadrotor, body, Hover(15.0), 15.0)
    assert record.positions[:, 0, 0].max() > 1.3
    assert (record.states[-1].position - torch.tensor([1.0, 2.0, 5.0])).norm() < 0.05


def test_a_command_keeps_its_own_reference(hovering):
    """A command neither changes the drone's reference nor follows later changes of it."""
    body = hovering((1, 2, 5))
    before = body.reference.clone()
    yaw_control = RotateToCommand(1.0, 0.01, 10.0)
    yaw_control.begin(body)
    assert torch.equal(body.reference, before)
    staying = Hover(1.0)
    staying.begin(body)
    body.reference[:, 0] = 9.0
    assert torch.equal(staying.rest(body), before)
    assert yaw_control.rest(body)[0].tolist() == [1.0, 2.0, 1.0, 5.0]


def test_turning_the_shorter_way(quadrotor, hovering):
    command = RotateToCommand(math.radians(-170), math.radians(1), 10.0)
    body = hovering((0, 0, 5))
    body = fly_command(
        quadrotor, body, RotateToCommand(math.radians(170), 0.01, 10.0), 10.0
    ).states[-1]
    record = fly_command(quadrotor, body, command, 10.0)
    assert record.times[record.done].item() < 3.0
    assert all(abs(state.heading.item()) > 2.8 for state in record.states)
    assert record.states[-1].heading.item() == pytest.approx(math.radians(-170), abs=0.02)


def test_turning_at_a_rate(quadrotor, hovering):
    command = RotateByCommand(math.radians(45), 2.1)
    last = fly_command(quadrotor, hovering((0, 0, 5)), command, 9.0).states[-1]
    pace = 0.25 * 4.0 * 0.055562 / 0.01428  # gain, torque and inertia: one over a lag of 0.26 s
    expected = math.radians(45) * (2.1 - 1.0 / pace)
    assert last.heading.item() == pytest.approx(expected, abs=0.01)
    assert command.rest(last)[0].tolist() == [0, 0, last.heading.item(), 5]
    assert (last.position - torch.tensor([0, 0, 5.0])).norm() < 0.05
