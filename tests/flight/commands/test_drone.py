import math

import pytest
import torch

from drone_rl.flight.commands.command import hold
from drone_rl.flight.commands.drone import Drone
from drone_rl.flight.commands.state import LandedState
from drone_rl.sim.dynamics.control import rotor_goals
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError


@pytest.fixture
def drone(quadrotor):
    return Drone(quadrotor, start=(1, 2), yaw=90)


def test_unarmed_rotors_stand_still(drone):
    drone._fly(hold(drone.body.reference), 100)
    assert drone.body.rotors.abs().max() == 0.0
    assert drone.time == pytest.approx(0.3)
    assert drone.state.position == pytest.approx((1, 2, 0.3))
    assert drone.state.attitude.yaw == pytest.approx(90)


def test_armed_rotors_idle(drone, quadrotor):
    drone._is_armed = True
    drone._fly(None, 100)
    assert drone.body.rotors.mean().item() == pytest.approx(0.1 * quadrotor.settings.hover_throttle)
    assert drone._landed == LandedState.LANDED
    assert float(drone.body.velocity.norm()) < 0.01


def test_it_flies_when_it_climbs_and_has_landed_when_it_lies_still(drone):
    drone._is_armed = True
    drone._fly(rotor_goals(torch.full((1, 4), 0.8, dtype=torch.float64)), 100)
    assert drone._is_flying
    drone._is_armed = False
    drone._fly(None, 1)
    assert drone._is_flying
    for _ in range(200):
        drone._fly(None, 7)
    assert not drone._is_flying
    assert drone.state.collision.thing == "ground"


def test_idle_rotors_do_not_take_off(drone, hovering):
    drone.body = hovering((0, 0, 9))
    drone.body.velocity[0, 2] = 1.0
    drone.body.rotors[:] = 0.05
    drone._update_landed()
    assert not drone._is_flying
    drone.body.rotors[:] = 0.15
    drone._update_landed()
    assert drone._is_flying


def test_seeds_have_31_bits(quadrotor):
    Drone(quadrotor, seed=2**31 - 1)
    with pytest.raises(InputError, match="seed=2147483648"):
        Drone(quadrotor, seed=2**31)


def test_a_still_drone_in_the_air_has_not_landed(drone, hovering):
    drone.body, drone._landed = hovering((0, 0, 9)), LandedState.FLYING
    drone._fly(None, 1)  # not armed: its rotors stop, and it hardly moves yet
    assert float(drone.body.velocity.norm()) < 0.08
    assert drone._is_flying


def test_time_goes_on_for_a_lost_drone(drone):
    drone._is_armed = True
    drone.body.velocity[0, 0] = math.nan
    drone._fly(hold(drone.body.reference), 10)
    drone._fly(hold(drone.body.reference), 10)
    assert drone._is_lost
    assert drone.time == pytest.approx(0.06)
    assert drone.state.position == (1, 2, 0.3)


def test_ticks(drone):
    assert drone._ticks_of(0.3) == 100
    assert drone._ticks_of(0.301) == 101


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
    with pytest.raises(InputError, match=r"^worlds=1 is no Worlds"):
        Drone(worlds=1)  # pyright: ignore[reportArgumentType]
    worlds = Worlds(1)
    drone = Drone(worlds=worlds)
    assert torch.equal(drone.picture(0), drone.picture("front_center"))
    with pytest.raises(InputError, match="front_center"):
        drone.picture("front")
    with pytest.raises(InputError, match="requests"):
        drone.images("front_center")  # pyright: ignore[reportArgumentType]
    worlds.close()
