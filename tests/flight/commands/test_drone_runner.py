import pytest
import torch

from drone_rl.flight.commands.command import Hover, Land, RotateToCommand


def test_time_passes_to_the_tick(hovering_pilot):
    drone = hovering_pilot
    drone._advance(10)
    drone._advance(3)
    assert drone.body.ticks.item() == 13


def test_what_lasts_is_done_when_its_time_is_over(hovering_pilot):
    drone = hovering_pilot
    future = drone._start("hover", Hover(drone.body, 0.1), False)
    drone._advance(28)
    assert not future.done
    drone._advance(7)
    assert future.result() is True
    assert future.elapsed == pytest.approx(0.105)


def test_what_should_have_come_to_an_end_has_failed(hovering_pilot):
    drone = hovering_pilot
    future = drone._start("rotate", RotateToCommand(drone.body, 3.0, 0.01, 0.1), False)
    assert future.result() is False
    assert not future.cancelled


def test_no_time_at_all(hovering_pilot):
    drone = hovering_pilot
    assert drone._start("hover", Hover(drone.body, 0.0), False).result() is True
    assert (
        drone._start("rotate", RotateToCommand(drone.body, 3.0, 0.01, 0.0), False).result() is False
    )
    assert drone.time == 0.0


def test_the_next_command_ends_the_one_before(hovering_pilot):
    drone = hovering_pilot
    first = drone.move_by_velocity(1, 0, duration=9, z=5, wait=False)
    drone._advance(10)
    second = drone._start("hover", Hover(drone.body, 1.0), False)
    assert (first.cancelled, first.result()) == (True, False)
    assert drone.running is second
    assert second.result() is True
    assert drone.running is None


def test_after_a_velocity_it_stays_where_it_is_60_ms_later(hovering_pilot):
    drone = hovering_pilot
    drone.move_by_velocity(2, 0, duration=2, z=5, wait=False).result()
    place = drone.body.position[0, 0].item()
    drone._advance(20)
    later = drone.body.position[0, 0].item()
    assert later > place + 0.05
    drone._advance(3000)
    x = drone.body.position[0, 0].item()
    assert x == pytest.approx(later, abs=0.05)


def test_after_landing_its_rotors_idle(hovering_pilot):
    drone = hovering_pilot
    drone.body.position[0, 2] = 0.5
    assert drone._start("land", Land(drone.body, 20.0), False).result() is True
    assert not drone._is_flying
    drone._advance(50)
    assert drone.body.rotors.max() < 0.1


def test_a_lost_drone_does_nothing_more(hovering_pilot):
    drone = hovering_pilot
    future = drone.move_by_velocity(1, 0, duration=9, z=5, wait=False)
    drone.body.velocity[0, 0] = torch.nan
    assert future.result() is False


def test_reset_nothing_is_asked_for(hovering_pilot):
    drone = hovering_pilot
    future = drone._start("hover", Hover(drone.body, 9.0), False)
    drone.disarm(force=True)
    assert future.cancelled
    drone._advance(100)
    assert drone.body.position[0, 2] < 4.7
