"""Arrays of drones that kernels fly are the states' own, and begin anew with each batch."""

import pytest
import torch
import warp as wp

from drone_rl.config import ActionSettings, DynamicsSettings
from drone_rl.sim.dynamics import Quadrotor
from drone_rl.sim.dynamics.moves_kernel import FlyingFleet
from drone_rl.sim.rendering.devices import start_warp

FLIGHT = DynamicsSettings(mode="simple_flight", camera_mount="body")


@pytest.fixture(autouse=True)
def warp():
    """Started, as whoever flies or draws has it."""
    start_warp("cpu")


def test_takes_drones_over_and_leaves_them_alone():
    quadrotor = Quadrotor(FLIGHT, ActionSettings(move_lead=0.25))
    fleet = FlyingFleet(3, quadrotor)
    state = quadrotor.start(torch.tensor([[0.0, 1.0, 2.5]] * 2, dtype=torch.float64))
    fleet.begin(state)
    numbers = wp.to_torch(fleet.fleet.numbers)
    assert torch.equal(numbers[:2], state.numbers) and not numbers[2].any()
    numbers.fill_(7.0)
    assert state.position[0].tolist() == [0.0, 1.0, 2.5]
    assert fleet.fleet.lead == 0.25 and fleet.fleet.is_gimballed == 0
    assert fleet.fleet.command.ticks == 33


def test_none_fly_in_computer_vision_mode():
    assert FlyingFleet(3, None).fleet.numbers.shape == (0, 37)


def test_velocities_are_not_known():
    assert FlyingFleet.knows(Quadrotor(FLIGHT))
    assert not FlyingFleet.knows(Quadrotor(FLIGHT, ActionSettings(kind="velocity")))
