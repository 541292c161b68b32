import math

import pytest
import torch

from drone_rl.flight.commands.command import hold
from drone_rl.flight.commands.drone import Drone
from drone_rl.flight.commands.state import LandedState
from drone_rl.sim.dynamics.control import rotor_goals

GROUND = torch.tensor([1.0, 2.0, 0.3], dtype=torch.float64)


@pytest.fixture
def drone(quadrotor):
    return Drone(quadrotor, GROUND, math.pi / 2, 0)


def test_unarmed_rotors_stand_still(drone):
    drone.fly(hold(drone.here()), 100)
    assert drone.body.rotors.abs().max() == 0.0
    assert drone.time == pytest.approx(0.3)
    assert drone.state.position == pytest.approx((1, 2, 0.3))
    assert drone.state.attitude.yaw == pytest.approx(90)


def test_armed_rotors_idle(drone, quadrotor):
    drone.armed = True
    drone.fly(None, 100)
    assert drone.body.rotors.mean().item() == pytest.approx(0.1 * quadrotor.settings.hover_throttle)
    assert drone.landed == LandedState.LANDED
    assert drone.speed < 0.01


def test_it_flies_when_it_climbs_and_has_landed_when_it_lies_still(drone):
    drone.armed = True
    drone.fly(rotor_goals(torch.full((1, 4), 0.8, dtype=torch.float64)), 100)
    assert drone.is_flying
    drone.armed = False
    drone.fly(None, 1)
    assert drone.is_flying
    for _ in range(200):
        drone.fly(None, 7)
    assert not drone.is_flying
    assert drone.state.collision.thing == "ground"


def test_a_still_drone_in_the_air_has_not_landed(drone, hovering):
    drone.body, drone.landed = hovering((0, 0, 9)), LandedState.FLYING
    drone.fly(None, 1)  # not armed: its rotors stop, and it hardly moves yet
    assert drone.speed < 0.08
    assert drone.is_flying


def test_time_goes_on_for_a_lost_drone(drone):
    drone.armed = True
    drone.body.velocity[0, 0] = math.nan
    drone.fly(hold(drone.here()), 10)
    drone.fly(hold(drone.here()), 10)
    assert drone.is_lost
    assert drone.time == pytest.approx(0.06)
    assert drone.state.position == (1, 2, 0.3)


def test_ticks(drone):
    assert drone.ticks_of(0.3) == 100
    assert drone.ticks_of(0.301) == 101
