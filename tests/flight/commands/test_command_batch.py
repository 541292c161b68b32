import torch

from drone_rl.config import DynamicsSettings
from drone_rl.flight.commands.command import fly_command, period_ticks
from drone_rl.flight.commands.movement import Land, VelocityCommand
from drone_rl.sim.dynamics import Obstacles


def test_a_period_is_at_least_20_ms():
    ticks = {0.003: 7, 0.001: 20, 0.02: 1, 0.004: 5}
    assert {t: period_ticks(DynamicsSettings(tick=t)) for t in ticks} == ticks


def test_it_goes_on_until_the_last_drone_is_done(quadrotor, hovering):
    record = fly_command(quadrotor, hovering((0, 0, 0.5), (3, 0, 0.8)), Land(30.0), 30.0)
    first, last = record.done.tolist()
    assert first < last == len(record.times) - 1
    assert record.positions.shape == (last + 1, 2, 3)
    assert record.times[1].item() == 0.021


def test_what_is_never_done_ends_with_the_time(quadrotor, hovering):
    record = fly_command(quadrotor, hovering((0, 0, 5)), Land(30.0), 0.5)
    assert record.done.tolist() == [len(record.times)] == [24]  # at 0 s, and after 23 periods


def test_obstacles_are_in_the_way(quadrotor, hovering):
    wall = Obstacles(torch.tensor([[[2.0, 0.0, 5.0]]], dtype=torch.float64), (0.5, 5.0, 5.0))
    body = hovering((0, 0, 5))
    record = fly_command(quadrotor, body, VelocityCommand((3.0, 0.0), 3.0, z=5.0), 3.0, wall)
    assert record.positions[..., 0].max() <= 1.2 + 1e-5  # half a metre of wall, 0.3 m of drone
