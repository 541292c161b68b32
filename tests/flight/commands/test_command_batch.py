import torch

from benchmarks.flight_paths import fly_command
from drone_rl.config import DynamicsSettings
from drone_rl.flight.commands.command import Land, TimedCommand, goals_of, period_ticks
from drone_rl.sim.dynamics import Mode, Obstacles


def test_a_period_is_at_least_20_ms():
    ticks = {0.003: 7, 0.001: 20, 0.02: 1, 0.004: 5}
    assert {t: period_ticks(DynamicsSettings(tick=t)) for t in ticks} == ticks


def test_it_goes_on_until_the_last_drone_is_done(quadrotor, hovering):
    body = hovering((0, 0, 0.5), (3, 0, 0.8))
    states, done = fly_command(quadrotor, body, Land(body, 30.0), 30.0)
    first, last = done.tolist()
    assert first < last == len(states) - 1
    assert states[1].ticks.tolist() == [7, 7]


def test_what_is_never_done_ends_with_the_time(quadrotor, hovering):
    body = hovering((0, 0, 5))
    states, done = fly_command(quadrotor, body, Land(body, 30.0), 0.5)
    assert done.tolist() == [len(states)] == [24]  # at 0 s, and after 23 periods


def test_obstacles_are_in_the_way(quadrotor, hovering):
    wall = Obstacles(torch.tensor([[[2.0, 0.0, 5.0]]], dtype=torch.float64), (0.5, 5.0, 5.0))
    body = hovering((0, 0, 5))
    modes = (Mode.VELOCITY, Mode.VELOCITY, Mode.ANGLE, Mode.POSITION)
    command = TimedCommand(lambda body: goals_of(body, modes, 3.0, 0.0, 0.0, 5.0), 1.5)
    states, _ = fly_command(quadrotor, body, command, obstacles=wall)
    x = max(state.position[0, 0].item() for state in states)
    assert 1.0 < x <= 1.2 + 1e-5  # half a metre of wall, 0.3 m of drone
