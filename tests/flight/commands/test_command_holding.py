import math

import pytest
import torch

from benchmarks.flight_paths import fly_command
from drone_rl.flight.commands.command import Hover, RotateByCommand, RotateToCommand


def test_hovering_comes_back(quadrotor, hovering):
    body = hovering((1, 2, 5))
    body.velocity[0, 0] = 1.0
    states, _ = fly_command(quadrotor, body, Hover(body, 15.0))
    assert max(state.position[0, 0] for state in states) > 1.3
    assert (states[-1].position - torch.tensor([1.0, 2.0, 5.0])).norm() < 0.05


def test_a_command_keeps_its_own_reference(hovering):
    """A command neither changes the drone's reference nor follows later changes of it."""
    body = hovering((1, 2, 5))
    before = body.reference.clone()
    turning = RotateToCommand(body, 1.0, 0.01, 10.0)
    assert torch.equal(body.reference, before)
    staying = Hover(body, 1.0)
    body.reference[:, 0] = 9.0
    assert torch.equal(staying.rest(body), before)
    assert turning.rest(body)[0].tolist() == [1.0, 2.0, 1.0, 5.0]


def test_turning_the_shorter_way(quadrotor, hovering):
    body = hovering((0, 0, 5))
    body.attitude[0] = body.attitude.new_tensor(
        [math.cos(math.radians(85)), 0, 0, math.sin(math.radians(85))]
    )
    command = RotateToCommand(body, math.radians(-170), math.radians(1), 10.0)
    states, done = fly_command(quadrotor, body, command)
    assert done.item() * 0.021 < 3.0
    assert all(abs(state.heading.item()) > 2.8 for state in states)
    assert states[-1].heading.item() == pytest.approx(math.radians(-170), abs=0.02)


def test_turning_at_a_rate(quadrotor, hovering):
    body = hovering((0, 0, 5))
    command = RotateByCommand(body, math.radians(45), 2.1)
    last = fly_command(quadrotor, body, command)[0][-1]
    pace = 0.25 * 4.0 * 0.055562 / 0.01428  # gain, torque and inertia: one over a lag of 0.26 s
    expected = math.radians(45) * (2.1 - 1.0 / pace)
    assert last.heading.item() == pytest.approx(expected, abs=0.01)
    assert command.rest(last)[0].tolist() == [0, 0, last.heading.item(), 5]
    assert (last.position - torch.tensor([0, 0, 5.0])).norm() < 0.05
