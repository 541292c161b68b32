import torch

from benchmarks.flight_paths import fly_command
from drone_rl.flight.commands.command import Land


def test_it_sinks_slowly_and_is_done_where_it_stands(quadrotor, hovering):
    body = hovering((3, 4, 1.3))
    states, done = fly_command(quadrotor, body, Land(body, 30.0))
    seconds = done.item() * 0.021
    assert 5.0 < seconds < 6.0  # 1 m at 0.2 m/s, and ten periods
    last = states[-1].position[0]
    assert (last - torch.tensor([3.0, 4.0, 0.3])).norm() < 0.01
    heights = torch.stack([state.position[0, 2] for state in states])
    assert heights.diff().min() > -0.25 * 0.021


def test_ten_periods_without_sinking(hovering):
    body = hovering((0, 0, 5))
    command = Land(body, 30.0)
    assert [command.is_complete(body).item() for _ in range(11)] == [False] * 10 + [True]
    body.velocity[0, 2] = -0.1
    assert not command.is_complete(body).item()
