"""Moves of the fused kernel equal those of the quadrotor bit for bit."""

import pytest
import torch
import warp as wp

from drone_rl.config import DynamicsSettings
from drone_rl.sim.dynamics import Quadrotor
from drone_rl.sim.dynamics.moves_kernel import (
    Fleet,
    camera_attitude,
    fly_move,
    is_flying,
    is_lost,
    make_fleet,
)
from drone_rl.sim.dynamics.state import twist_about_z
from drone_rl.sim.rendering.devices import start_warp

start_warp("cpu")


@wp.kernel(enable_backward=False, module="unique")
def moved(
    fleet: Fleet,
    action: int,
    places: wp.array(dtype=wp.vec3d),
    turns: wp.array(dtype=wp.vec4),
    flags: wp.array(dtype=int),
) -> None:
    world = wp.tid()
    if is_flying(fleet):
        places[world] = fly_move(fleet, world, action)
        turns[world] = camera_attitude(fleet, world)
        if is_lost(fleet, world):
            flags[world] = 1


@pytest.mark.parametrize("mount", ["gimbal", "body"])
def test_moves_equal_quadrotor_steps(mount):
    settings = DynamicsSettings(mode="simple_flight", camera_mount=mount, wind=(1.0, -2.0, 0.3))
    quadrotor = Quadrotor(settings)
    state = quadrotor.start(torch.tensor([[0.0, 0.0, 2.5], [9.0, -3.0, 4.0]], dtype=torch.float64))
    fleet = make_fleet(quadrotor, state.numbers.clone())
    places, turns = torch.zeros(2, 3, dtype=torch.float64), torch.zeros(2, 4)
    flags = torch.zeros(2, dtype=torch.int32)
    for action in (0, 0, 1, 2, 2, 1, 0):
        state = quadrotor.step(state, torch.full((2,), action))
        given = [wp.from_torch(places, dtype=wp.vec3d), wp.from_torch(turns, dtype=wp.vec4)]
        inputs = [fleet, action, *given, wp.from_torch(flags)]
        wp.launch(moved, 2, inputs=inputs, device="cpu")
        assert torch.equal(places, state.position)
        assert torch.equal(wp.to_torch(fleet.numbers), state.numbers)
        seen = state.attitude if mount == "body" else twist_about_z(state.attitude)
        assert torch.equal(turns, seen.float())
    assert not flags.any()
    assert state.attitude[0, 2].abs() > 1e-3  # the drone is tilted, so mounts differ


def test_lost_drone_is_flagged():
    quadrotor = Quadrotor(DynamicsSettings(mode="simple_flight"))
    state = quadrotor.start(torch.zeros(1, 3, dtype=torch.float64))
    state.velocity[:] = torch.nan
    fleet = make_fleet(quadrotor, state.numbers.clone())
    places, turns = torch.zeros(1, 3, dtype=torch.float64), torch.zeros(1, 4)
    flags = torch.zeros(1, dtype=torch.int32)
    given = [wp.from_torch(places, dtype=wp.vec3d), wp.from_torch(turns, dtype=wp.vec4)]
    wp.launch(moved, 1, inputs=[fleet, 0, *given, wp.from_torch(flags)], device="cpu")
    assert flags.tolist() == [1] and places.tolist() == [[0.0, 0.0, 0.0]]
