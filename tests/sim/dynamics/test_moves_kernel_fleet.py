"""State arrays of the fused kernel are set from states at the start of each batch."""

import pytest
import torch
import warp as wp

from drone_rl.config import ActionSettings, DynamicsSettings
from drone_rl.sim.dynamics import Quadrotor
from drone_rl.sim.dynamics.moves_kernel import make_fleet
from drone_rl.sim.rendering.devices import start_warp

FLIGHT = DynamicsSettings(mode="simple_flight", camera_mount="body")


@pytest.fixture(autouse=True)
def warp():
    """Start Warp."""
    start_warp("cpu")


def test_fleet_copies_states():
    quadrotor = Quadrotor(FLIGHT, ActionSettings(move_lead=0.25))
    state = quadrotor.start(torch.tensor([[0.0, 1.0, 2.5]] * 2, dtype=torch.float64))
    fleet = make_fleet(quadrotor, state.numbers)
    wp.to_torch(fleet.numbers).fill_(7.0)
    assert state.position[0].tolist() == [7.0] * 3
    assert fleet.lead == 0.25 and fleet.is_gimballed == 0
    assert fleet.command.ticks == 33


def test_computer_vision_mode_has_no_fleet_states():
    assert make_fleet(None, torch.zeros(0, 37).double()).numbers.shape == (0, 37)
