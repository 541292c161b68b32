import torch

from benchmarks.flight_paths import fly_command
from drone_rl.flight.commands.path_following import GoHomeCommand, PathCommand


def test_over_its_home_first_and_down_then(quadrotor, hovering):
    home = torch.tensor([[[0.0, 0.0, 1.5]]], dtype=torch.float64)
    body = hovering((5, 0, 1.5))
    command = GoHomeCommand(PathCommand(body, home, 2.0, 20.0), 20.0)
    assert command.limit == 40.0
    states, done = fly_command(quadrotor, body, command)
    x, _, z = torch.cat([state.position for state in states]).unbind(-1)
    assert done.item() == len(states) - 1
    assert x[z < 1.4].max() < 0.5
    assert (states[-1].position - home[0] + torch.tensor([0, 0, 1.2])).norm() < 0.05
