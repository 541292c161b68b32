import torch

from drone_rl.flight.commands.command import fly_command
from drone_rl.flight.commands.movement import GoHomeCommand, Land
from drone_rl.flight.commands.path_following import PathCommand


def test_over_its_home_first_and_down_then(quadrotor, hovering):
    home = torch.tensor([[[0.0, 0.0, 1.5]]], dtype=torch.float64)
    command = GoHomeCommand(PathCommand(home, 2.0, 20.0), Land(20.0))
    assert command.limit == 40.0
    record = fly_command(quadrotor, hovering((5, 0, 1.5)), command, 40.0)
    x, _, z = record.positions[:, 0].unbind(-1)
    assert record.done.item() == len(record.times) - 1
    assert x[z < 1.4].max() < 0.5
    assert (record.states[-1].position - home[0] + torch.tensor([0, 0, 1.2])).norm() < 0.05
