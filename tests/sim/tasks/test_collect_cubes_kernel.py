"""The fused kernel and the batched step equal the reference rules bit for bit."""

import pytest
import torch
import warp as wp
from numpy.random import RandomState

from drone_rl.config import ActionSettings, DynamicsSettings, TaskSettings
from drone_rl.sim.dynamics import ComputerVision, Obstacles, Quadrotor
from drone_rl.sim.rendering.devices import start_warp
from drone_rl.sim.rendering.raytrace.structs_kernel import PoseArrays
from drone_rl.sim.tasks import CollectCubes, Pillars
from drone_rl.sim.tasks.collect_cubes import CubesEnd, Side
from drone_rl.sim.tasks.fused import fused_rules
from drone_rl.sim.tasks.rules_kernel import Episodes, place
from drone_rl.sim.worlds import Worlds

start_warp("cpu")


WORLDS = 60
move = CollectCubes().rules.compiled.move


@wp.kernel(enable_backward=False)
def step(
    envs: Episodes, poses: PoseArrays, actions: wp.array(dtype=int), rewards: wp.array(dtype=float)
) -> None:
    env = wp.tid()
    if envs.end_reasons[env] == 0:
        rewards[env] = move(envs, env, actions[env])
        place(envs, env, poses)


@pytest.mark.parametrize(
    ("settings", "ends"),
    [
        ({}, {CubesEnd.FRONT_BOUNDARY}),
        ({"num_cubes": 1, "lateral_bound": 2.0}, {CubesEnd.ALL_CUBES, CubesEnd.FRONT_BOUNDARY}),
        ({"side_margin": 0.3, "vertical_bound": 1.2}, {CubesEnd.SIDE_BOUNDARY}),
        ({"step_limit": 33, "step_length": 1.3}, {CubesEnd.STEP_LIMIT}),
    ],
)
def test_random_episodes_follow_the_reference_rules(settings, ends):
    task = TaskSettings(**settings)
    worlds, draws = Worlds(WORLDS, task), torch.Generator().manual_seed(0)
    worlds.reset(torch.arange(WORLDS), [RandomState(i) for i in range(WORLDS)])
    fused = fused_rules(worlds.task, worlds.dynamics, worlds.state)
    fused.begin(worlds.state)
    places, poses = torch.zeros(WORLDS, 2 + len(worlds.task.objects), 3), PoseArrays()
    poses.positions = wp.from_torch(places, dtype=wp.vec3)
    poses.attitudes = wp.zeros(WORLDS, dtype=wp.vec4, device="cpu")
    state, going, seen = worlds.state, torch.arange(WORLDS), set()
    rewards = torch.zeros(WORLDS)
    while len(going):
        chances = torch.tensor([0.7, 0.2, 0.1] if len(going) % 2 else [0.7, 0.1, 0.2])
        actions = chances.multinomial(WORLDS, replacement=True, generator=draws)
        inputs = [wp.from_torch(actions.int()), wp.from_torch(rewards)]
        wp.launch(step, WORLDS, inputs=[fused.arrays, poses, *inputs], device="cpu")
        before, moved = state, worlds.dynamics.step(state.body, actions[going])
        state, reward = worlds.advance(state, actions[going])
        expected, earned = reference_step(task, before, moved)
        assert torch.equal(reward, earned)
        for name, value in expected.items():
            torch.testing.assert_close(getattr(state, name), value, rtol=0, atol=0, equal_nan=True)
        assert torch.equal(rewards[going].double(), reward)
        assert torch.equal(wp.to_torch(fused.arrays.drones)[going], state.drone)
        for name in ("reached", "sides", "noted"):
            found = wp.to_torch(getattr(fused.arrays.world, name))[going]
            torch.testing.assert_close(found, getattr(state, name), rtol=0, atol=0, equal_nan=True)
        assert torch.equal(wp.to_torch(fused.arrays.world.objects.present)[going], state.present)
        assert torch.equal(fused.steps[going].long(), state.steps)
        assert torch.equal(fused.end_reasons[going].long(), state.end_reason)
        assert torch.equal(places[going, 1], state.drone.float())
        assert torch.equal(places[going, 2:], worlds.task.places(state).float())
        assert not places[:, 0].any()
        is_on = state.end_reason == 0
        seen |= {*state.end_reason.tolist()}
        state, going = state[is_on], going[is_on]
    assert ends <= seen


def reference_step(settings, state, body):
    """Return the fields of the state after a step, and the reward."""
    drone = body.position
    away = (drone[:, None] - state.places).abs().amax(-1)  # (N, C)
    touched = state.present & (away <= settings.touch_distance)
    collected = state.reached | touched
    present = state.present & ~touched & (drone[:, None, 0] <= state.places[..., 0])
    side, lateral = sightings(settings, state, drone, present)
    x, y, _ = drone.unbind(-1)
    reason = (
        torch.zeros_like(state.steps)
        .masked_fill(state.steps + 1 >= settings.step_limit, CubesEnd.STEP_LIMIT)
        .masked_fill(y.abs() > settings.side_bound, CubesEnd.SIDE_BOUNDARY)
        .masked_fill(x > settings.front_bound, CubesEnd.FRONT_BOUNDARY)
        .masked_fill(collected.all(-1), CubesEnd.ALL_CUBES)
        .masked_fill(body.is_lost, CubesEnd.LOST_CONTROL)
    )
    new = {"reached": collected, "present": present, "sides": side.int(), "noted": lateral}
    return {**new, "end_reason": reason}, touched.sum(-1, dtype=torch.float64)


def sightings(settings, state, drone, present):
    """Return side and lateral offset recorded for each cube up to the next one."""
    offset = state.places[..., 1] - drone[:, None, 1]
    right = torch.where(offset < -settings.touch_distance, Side.RIGHT.value, Side.AHEAD.value)
    side = torch.where(offset > settings.touch_distance, Side.LEFT.value, right)
    next_cube = (~present).long().cumprod(-1).sum(-1)
    is_new = (state.sides < 0) & (torch.arange(side.shape[-1]) <= next_cube[:, None])
    return torch.where(is_new, side, state.sides), torch.where(is_new, offset, state.noted)


class Windy(ComputerVision):
    """Other dynamics."""


class Strict(CollectCubes):
    def step(self, state, body):
        return super().step(state, body)


class Raised(CollectCubes):
    def places(self, state):
        return super().places(state) + 1.0


class Solid(CollectCubes):
    def obstacles(self, state):
        return Obstacles(self.places(state), (1.0, 1.0, 1.0))


FLIGHT, VELOCITIES = DynamicsSettings(mode="simple_flight"), ActionSettings(kind="velocity")


@pytest.mark.parametrize(
    ("task", "dynamics", "is_supported"),
    [
        (CollectCubes, Windy(), False),
        (CollectCubes, Quadrotor(FLIGHT, VELOCITIES), True),
        (Strict, ComputerVision(), False),
        (Raised, ComputerVision(), False),
        (Solid, Quadrotor(FLIGHT), False),
        (Pillars, Quadrotor(FLIGHT), True),
    ],
)
def test_only_unchanged_rules_are_fused(task, dynamics, is_supported):
    worlds = Worlds(1, task(), dynamics=dynamics)
    assert isinstance(fused_rules(worlds.task, dynamics, worlds.state), str) != is_supported
