import math

import pytest
import torch

from drone_rl.config import DynamicsSettings
from drone_rl.flight.commands.command import PilotError
from drone_rl.flight.commands.drone import Drone
from drone_rl.flight.commands.pilot import Pilot
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError


@pytest.fixture
def drone(quadrotor):
    return Drone(quadrotor, start=(1, 2), yaw=90)


def test_a_notebook_shows_the_state_as_a_table(drone):
    shown = drone._repr_html_()
    for text in (
        "0.00 s",
        "landed, disarmed",
        "1.00, 2.00, 0.30 m",
        "0.00, 0.00, 0.00 m/s",
        "0.0, 0.0, 90.0 degrees",
        "none",
    ):
        assert f"<td>{text}</td>" in shown
    drone.arm()
    drone.advance(0.1)
    shown = drone._repr_html_()
    assert "landed, armed" in shown
    assert f"<td>ground, {drone.state.collision.time:.2f} s</td>" in shown


def test_wrong_worlds_cameras_and_requests_are_named():
    with pytest.raises(InputError, match=r"^worlds=1: it must be"):
        Drone(worlds=1)  # pyright: ignore[reportArgumentType]
    worlds = Worlds(1)
    drone = Drone(worlds=worlds)
    assert torch.equal(drone.picture(0), drone.picture("front_center"))
    with pytest.raises(InputError, match="front_center"):
        drone.picture("front")
    with pytest.raises(InputError, match="requests"):
        drone.images("front_center")  # pyright: ignore[reportArgumentType]
    worlds.close()


def test_the_next_command_ends_the_one_before(hovering_pilot):
    drone = hovering_pilot
    first = drone.move_by_velocity(1, 0, duration=9, z=5, wait=False)
    drone._advance(10)
    second = drone.hover(1.0, wait=False)
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


def test_it_begins_on_the_ground_disarmed(quadrotor):
    pilot = Pilot(quadrotor, start=(3, -2), yaw=30)
    state = pilot.state
    assert state.position == (3, -2, 0.3)
    assert state.attitude.yaw == pytest.approx(30)
    assert (state.armed, state.landed, state.collision) == (False, "landed", None)
    assert (pilot.time, pilot.running) == (0.0, None)


def test_settings_one_by_one():
    pilot = Pilot(DynamicsSettings(mass=1.2), wind=[5, 0, 0])
    assert pilot.settings.wind == (5.0, 0.0, 0.0)
    assert (pilot.settings.mass, pilot.settings.mode) == (1.2, "simple_flight")


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"mass": 3}, "can't carry and control"),
        ({"wings": 2}, "wings is unknown"),
        ({"start": (0, 0, 5)}, r"start=\[0,0,5\]"),
    ],
)
def test_what_can_be_no_drone(given, told):
    with pytest.raises(InputError, match=told):
        Pilot(**given)


def test_a_drone_with_strong_rotors_counts_as_flying():
    pilot = Pilot(mass=0.1)  # hovers at 6% of the thrust
    pilot.arm()
    assert pilot.take_off()
    assert pilot.state.landed == "flying"
    assert pilot.move_to(2, 0, 3, speed=2)
    assert pilot.land() and pilot.state.landed == "landed"


def test_what_does_not_go_together(quadrotor):
    with pytest.raises(InputError, match="mass and a Quadrotor are given"):
        Pilot(quadrotor, mass=1.1)
    with pytest.raises(InputError, match="worlds has 2 worlds"):
        Pilot(worlds=Worlds(2))


def test_no_arming_and_no_disarming_in_the_air(flying):
    with pytest.raises(PilotError, match="can't disarm in the air"):
        flying.disarm()
    flying.disarm(force=True)
    assert not flying.state.armed
    flying.advance(0.1)
    with pytest.raises(PilotError, match="can't arm in the air"):
        flying.arm()
    flying.advance(5.0)
    assert flying.state.landed == "landed"
    flying.arm()
    assert flying.state.armed


def test_commands_of_a_drone_that_is_not_armed_or_does_not_fly():
    pilot = Pilot()
    for command in (pilot.take_off, pilot.land, pilot.go_home, pilot.hover):
        with pytest.raises(PilotError, match=r"isn't armed; call arm\(\) first"):
            command()
    pilot.arm()
    with pytest.raises(PilotError, match=r"hover: the drone is on the ground; call take_off"):
        pilot.hover()


def test_a_lost_drone_is_told_nothing_and_its_time_goes_on(flying):
    future, before = flying.move_by_velocity(1, 0, duration=9, wait=False), flying.state
    flying.body.velocity[0, 0] = math.nan
    flying.advance(0.3)
    assert flying.state.lost and future.result() is False
    assert flying.state.position == before.position
    assert flying.time == pytest.approx(before.time + 0.3)
    with pytest.raises(PilotError, match="simulation has diverged; make a new Pilot"):
        flying.hover()


def test_the_running_command_ends_with_the_block(flying):
    with flying as pilot:
        future = pilot.hover(9.0, wait=False)
        assert pilot.running is future
    assert future.cancelled


def test_cancelling(flying):
    future = flying.move_to(9, 0, 3, wait=False)
    flying.advance(0.5)
    flying.cancel()
    assert (future.cancelled, flying.running) == (True, None)
