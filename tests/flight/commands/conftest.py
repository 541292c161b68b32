"""Drones in still air, in tests' hands."""

import pytest
import torch

from drone_rl.config import DynamicsSettings
from drone_rl.flight.commands.pilot import Pilot
from drone_rl.sim.dynamics import Quadrotor


@pytest.fixture(scope="session")
def quadrotor():
    return Quadrotor(DynamicsSettings(mode="simple_flight"))


@pytest.fixture
def hovering(quadrotor):
    """Makes drones that hover at places."""
    return lambda *places: quadrotor.start(torch.tensor(places, dtype=torch.float64))


@pytest.fixture
def flying():
    """A pilot whose drone has taken off."""
    pilot = Pilot()
    pilot.arm()
    assert pilot.take_off()
    return pilot
