import math

import pytest
import torch

from benchmarks.flight_paths import fly_command
from drone_rl.config import DynamicsSettings
from drone_rl.flight.commands.command import (
    FlightFuture,
    Hover,
    Land,
    RotateByCommand,
    RotateToCommand,
    TimedCommand,
    period_ticks,
)


def test_a_period_is_at_least_20_ms():
    ticks = {0.003: 7, 0.001: 20, 0.02: 1, 0.004: 5}
    assert {t: period_ticks(DynamicsSettings(tick=t)) for t in ticks} == ticks


def test_hovering_comes_back(quadrotor, hovering):
    body = hovering((1, 2, 5))
    body.velocity[0, 0] = 1.0
    command = Hover(body, 15.0)
    states, _ = fly_command(quadrotor, body, command)
    assert max(state.position[0, 0] for state in states) > 1.3
    assert states[-1].position[0].tolist() == pytest.approx([1, 2, 5], abs=0.05)
    body.reference[:, 0] = 9.0  # a command does not follow later changes
    assert command.rest(body) == [1.0, 2.0, 0.0, 5.0]


def test_turning_the_shorter_way(quadrotor, hovering):
    body = hovering((0, 0, 5))
    body.attitude[0] = body.attitude.new_tensor(
        [math.cos(math.radians(85)), 0, 0, math.sin(math.radians(85))]
    )
    command = RotateToCommand(body, math.radians(-170), math.radians(1), 10.0)
    states, done = fly_command(quadrotor, body, command)
    assert done * 0.021 < 3.0
    assert all(abs(state.heading.item()) > 2.8 for state in states)
    assert states[-1].heading.item() == pytest.approx(math.radians(-170), abs=0.02)


def test_turning_at_a_rate(quadrotor, hovering):
    body = hovering((0, 0, 5))
    command = RotateByCommand(body, math.radians(45), 2.1)
    last = fly_command(quadrotor, body, command)[0][-1]
    pace = 0.25 * 4.0 * 0.055562 / 0.01428  # gain, torque and inertia: one over a lag of 0.26 s
    expected = math.radians(45) * (2.1 - 1.0 / pace)
    assert last.heading.item() == pytest.approx(expected, abs=0.01)
    assert command.rest(last) == [0, 0, last.heading.item(), 5]
    assert last.position[0].tolist() == pytest.approx([0, 0, 5], abs=0.05)


def test_it_sinks_slowly_and_is_done_where_it_stands(quadrotor, hovering):
    body = hovering((3, 4, 1.3))
    states, done = fly_command(quadrotor, body, Land(body, 30.0))
    assert 5.0 < done * 0.021 < 6.0  # 1 m at 0.2 m/s, and ten periods
    assert states[-1].position[0].tolist() == pytest.approx([3, 4, 0.3], abs=0.01)
    heights = torch.stack([state.position[0, 2] for state in states])
    assert heights.diff().min() > -0.25 * 0.021
    assert fly_command(quadrotor, body, Land(body, 30.0), 0.5)[1] == 24  # never done in 23 periods


def test_ten_periods_without_sinking(hovering):
    body = hovering((0, 0, 5))
    command = Land(body, 30.0)
    assert [command.is_complete(body) for _ in range(11)] == [False] * 10 + [True]
    body.velocity[0, 2] = -0.1
    assert not command.is_complete(body)


def test_the_result_of_a_future_is_waited_for():
    future = FlightFuture("land", TimedCommand(None, 1.0), lambda future: future.finish(True))
    assert not future.done
    assert "running for 0.00 s" in repr(future)
    assert future.result() is True
    assert future.done and not future.cancelled
    assert repr(future) == "<land: done in 0.00 s>"


def test_what_is_cancelled_has_failed():
    future = FlightFuture("land", TimedCommand(None, 1.0), lambda future: None)
    future.cancel()
    assert (future.done, future.cancelled, future.result()) == (True, True, False)
    assert repr(future) == "<land: cancelled after 0.00 s>"
