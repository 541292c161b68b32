import pytest
import torch

from drone_rl.flight.commands.drone import Drone, Runner
from drone_rl.flight.commands.movement import Hover, Land, RotateToCommand, VelocityCommand
from drone_rl.flight.commands.state import LandedState


@pytest.fixture
def runner(quadrotor, hovering):
    drone = Drone(quadrotor, hovering((0, 0, 0.3)).position[0], 0.0, 0)
    drone.body, drone.armed, drone.landed = hovering((0, 0, 5)), True, LandedState.FLYING
    return Runner(drone)


def test_time_passes_to_the_tick(runner):
    runner.advance(10)
    runner.advance(3)
    assert runner.drone.body.ticks.item() == 13


def test_what_lasts_is_done_when_its_time_is_over(runner):
    future = runner.start("hover", Hover(0.1))
    runner.advance(28)
    assert not future.done
    runner.advance(7)
    assert future.result() is True
    assert future.elapsed == pytest.approx(0.105)


def test_what_should_have_come_to_an_end_has_failed(runner):
    future = runner.start("rotate", RotateToCommand(3.0, 0.01, 0.1))
    assert future.result() is False
    assert not future.cancelled


def test_no_time_at_all(runner):
    assert runner.start("hover", Hover(0.0)).result() is True
    assert runner.start("rotate", RotateToCommand(3.0, 0.01, 0.0)).result() is False
    assert runner.drone.time == 0.0


def test_the_next_command_ends_the_one_before(runner):
    first = runner.start("fly", VelocityCommand((1.0, 0.0), 9.0, z=5.0))
    runner.advance(10)
    second = runner.start("hover", Hover(1.0))
    assert (first.cancelled, first.result()) == (True, False)
    assert runner.running is second
    assert second.result() is True
    assert runner.running is None


def test_after_a_velocity_it_stays_where_it_is_60_ms_later(runner):
    runner.start("fly", VelocityCommand((2.0, 0.0), 2.0, z=5.0)).result()
    place = runner.drone.body.position[0, 0].item()
    runner.advance(20)
    later = runner.drone.body.position[0, 0].item()
    assert later > place + 0.05
    runner.advance(3000)
    x = runner.drone.body.position[0, 0].item()
    assert x == pytest.approx(later, abs=0.05)


def test_after_landing_its_rotors_idle(runner):
    runner.drone.body.position[0, 2] = 0.5
    assert runner.start("land", Land(20.0)).result() is True
    assert not runner.drone.is_flying
    runner.advance(50)
    assert runner.drone.body.rotors.max() < 0.1


def test_a_lost_drone_does_nothing_more(runner):
    future = runner.start("fly", VelocityCommand((1.0, 0.0), 9.0, z=5.0))
    runner.drone.body.velocity[0, 0] = torch.nan
    assert future.result() is False


def test_reset_nothing_is_asked_for(runner):
    future = runner.start("hover", Hover(9.0))
    runner.reset()
    assert future.cancelled
    runner.drone.armed = False
    runner.advance(100)
    assert runner.drone.body.position[0, 2] < 4.7
