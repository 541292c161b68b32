import torch

from drone_rl.sim.actions import Move
from drone_rl.sim.dynamics import ComputerVision


def test_moves_are_one_meter_forward_left_and_right():
    body = ComputerVision().start(torch.zeros(3, 3, dtype=torch.float64))
    moved = ComputerVision().step(body, torch.tensor([Move.FORWARD, Move.LEFT, Move.RIGHT]))
    assert moved.position.tolist() == [[1, 0, 0], [0, 1, 0], [0, -1, 0]]
    assert moved.attitude.tolist() == [[1, 0, 0, 0]] * 3
    assert not moved.velocity.any() and not moved.angular_velocity.any()
    assert not body.position.any()  # the input is unchanged
    half = ComputerVision(0.5).step(moved, torch.tensor([Move.LEFT] * 3))
    assert half.position.tolist() == [[1, 0.5, 0], [0, 1.5, 0], [0, -0.5, 0]]


def test_attitude_is_kept():
    dynamics = ComputerVision()
    body = dynamics.start(torch.zeros(1, 3, dtype=torch.float64))
    body.attitude[:] = torch.tensor([0.6, 0.0, 0.0, 0.8], dtype=torch.float64)
    assert dynamics.step(body, torch.tensor([0])).attitude.tolist() == [[0.6, 0.0, 0.0, 0.8]]
