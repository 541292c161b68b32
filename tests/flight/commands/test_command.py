import math

import pytest
import torch

from benchmarks.flight_paths import fly_command
from drone_rl.config import DynamicsSettings
from drone_rl.flight.commands.command import (
    HOLD,
    FlightFuture,
    Hover,
    Land,
    RotateByCommand,
    RotateToCommand,
    TimedCommand,
    goals_of,
    period_ticks,
)
from drone_rl.sim.dynamics import Mode, Obstacles


def test_goals_of_numbers_and_tensors(hovering):
    body = hovering((0, 0, 1), (0, 0, 2))
    goals = goals_of(body, HOLD, 1.0, torch.tensor([2.0, 3.0]), 0.5, body.position[:, 2])
    assert goals.values.tolist() == [[1, 2, 0.5, 1], [1, 3, 0.5, 2]]
    assert goals.modes == (Mode.POSITION, Mode.POSITION, Mode.ANGLE, Mode.POSITION)


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


def make(wait=lambda future: future.finish(True)):
    return FlightFuture("land", TimedCommand(None, 1.0), wait)


def test_its_result_is_waited_for():
    future = make()
    assert not future.done
    assert "running for 0.00 s" in repr(future)
    assert future.result() is True
    assert future.done
    assert not future.cancelled
    assert repr(future) == "<land: done in 0.00 s>"


def test_what_is_cancelled_has_failed():
    future = make()
    future.cancel()
    assert (future.done, future.cancelled, future.result()) == (True, True, False)
    assert repr(future) == "<land: cancelled after 0.00 s>"


def test_what_is_done_is_not_cancelled():
    future = make()
    future.finish(False)
    future.cancel()
    assert (future.cancelled, future.result()) == (False, False)
    assert "failed" in repr(future)
