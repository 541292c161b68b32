"""Drones in still air, in tests' hands."""

import pytest
import torch

from drone_rl.config import DynamicsSettings
from drone_rl.flight.commands.pilot import Pilot
from drone_rl.flight.commands.state import LandedState
from drone_rl.sim.dynamics import FlightState, Quadrotor


@pytest.fixture(scope="session")
def quadrotor():
    return Quadrotor(DynamicsSettings(mode="simple_flight"))


@pytest.fixture
def hovering(quadrotor):
    """Makes drones that hover at places."""
    return lambda *places: quadrotor.start(torch.tensor(places, dtype=torch.float64))


@pytest.fixture
def hovering_pilot(quadrotor, hovering):
    """A pilot whose drone has been put 5 m above the ground."""
    pilot = Pilot(quadrotor)
    pilot.body, pilot._is_armed, pilot._landed = hovering((0, 0, 5)), True, LandedState.FLYING
    return pilot


@pytest.fixture(scope="session")
def taken_off(quadrotor):
    """A pilot whose drone has taken off; `flying` copies its state."""
    pilot = Pilot(quadrotor)
    pilot.arm()
    assert pilot.take_off()
    return pilot


@pytest.fixture
def flying(quadrotor, taken_off):
    """A pilot whose drone has taken off."""
    pilot = Pilot(quadrotor)
    pilot.body = FlightState(taken_off.body.numbers.clone())
    pilot._place, pilot._is_armed = [*taken_off._place], True
    pilot._landed = LandedState.FLYING
    return pilot
