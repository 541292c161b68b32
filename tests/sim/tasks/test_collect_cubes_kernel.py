"""The fused kernel and the batched step equal the reference rules bit for bit."""

import pytest
import torch
import warp as wp
from numpy.random import RandomState

from drone_rl.config import ActionSettings, DynamicsSettings, TaskSettings
from drone_rl.sim.dynamics import ComputerVision, Obstacles, Quadrotor
from drone_rl.sim.rendering.devices import start_warp
from drone_rl.sim.rendering.raytrace.structs_kernel import Poses
from drone_rl.sim.tasks import CollectCubes, Pillars
from drone_rl.sim.tasks.collect_cubes import EndReason
from drone_rl.sim.tasks.collect_cubes_kernel import (
    EnvArrays,
    FusedCubes,
    move,
    place,
)
from drone_rl.sim.worlds import Worlds
from tests.sim.tasks.reference_rules import step as reference_step

start_warp("cpu")
WORLDS = 60


@wp.kernel(enable_backward=False)
def step(
    envs: EnvArrays, poses: Poses, actions: wp.array(dtype=int), rewards: wp.array(dtype=float)
) -> None:
    env = wp.tid()
    if envs.end_reasons[env] == 0:
        rewards[env] = move(envs, env, actions[env])
        place(envs, env, poses)


@pytest.mark.parametrize(
    ("settings", "ends"),
    [
        ({}, {EndReason.FRONT_BOUNDARY}),
        ({"num_cubes": 1, "lateral_bound": 2.0}, {EndReason.ALL_CUBES, EndReason.FRONT_BOUNDARY}),
        ({"side_margin": 0.3, "vertical_bound": 1.2}, {EndReason.SIDE_BOUNDARY}),
        ({"step_limit": 33, "step_length": 1.3}, {EndReason.STEP_LIMIT}),
    ],
)
def test_random_episodes_follow_the_reference_rules(settings, ends):
    task = TaskSettings(**settings)
    worlds, draws = Worlds(WORLDS, task), torch.Generator().manual_seed(0)
    worlds.reset(torch.arange(WORLDS), [RandomState(i) for i in range(WORLDS)])
    fused = worlds.task.fused_rules(worlds.dynamics, WORLDS)
    fused.begin(worlds.state)
    places = wp.to_torch(fused.poses.positions)
    state, going, seen = worlds.state, torch.arange(WORLDS), set()
    rewards = torch.zeros(WORLDS)
    while len(going):
        chances = torch.tensor([0.7, 0.2, 0.1] if len(going) % 2 else [0.7, 0.1, 0.2])
        actions = chances.multinomial(WORLDS, replacement=True, generator=draws)
        inputs = [wp.from_torch(actions.int()), wp.from_torch(rewards)]
        wp.launch(step, WORLDS, inputs=[fused.arrays, fused.poses, *inputs], device="cpu")
        before, moved = state, worlds.dynamics.step(state.body, actions[going])
        state, reward = worlds.advance(state, actions[going])
        expected, earned = reference_step(task, before, moved)
        assert torch.equal(reward, earned)
        for name, value in expected.items():
            torch.testing.assert_close(getattr(state, name), value, rtol=0, atol=0, equal_nan=True)
        assert torch.equal(rewards[going].double(), reward)
        assert torch.equal(wp.to_torch(fused.arrays.drones)[going], state.drone)
        for name in ("collected", "passed", "side", "lateral"):
            found, expected = getattr(fused.state, name)[going], getattr(state, name)
            torch.testing.assert_close(found, expected, rtol=0, atol=0, equal_nan=True)
        assert torch.equal(fused.steps[going].long(), state.steps)
        assert torch.equal(fused.end_reasons[going].long(), state.end_reason)
        assert torch.equal(places[going, 1], state.drone.float())
        assert torch.equal(places[going, 2:], worlds.task.places(state).float())
        assert not places[:, 0].any()
        is_on = state.end_reason == 0
        seen |= {*state.end_reason.tolist()}
        state, going = state[is_on], going[is_on]
    assert ends <= seen


def test_kernel_state_starts_from_a_copy_of_the_environments():
    settings = TaskSettings(num_cubes=2, altitude=3.0, vertical_bound=0.5)
    worlds = Worlds(2, settings)
    cubes = torch.tensor([[[15.0, 1.0, 3.0], [24.0, -2.0, 3.5]], [[15.0, 0.0, 3.0]] * 2])
    worlds.state = worlds.start(cubes.double())
    fused = FusedCubes(settings, worlds.dynamics, 3)
    for values in (fused.steps, fused.end_reasons, fused.state.collected):
        values.fill_(1)  # left by a previous batch
    fused.begin(worlds.state)
    assert wp.to_torch(fused.arrays.drones)[:2].tolist() == [[0.0, 0.0, 3.0]] * 2
    assert torch.equal(fused.state.cubes[:2], cubes.double())
    assert not fused.state.collected[:2].any() and fused.state.collected[2].all()
    assert fused.steps.tolist() == fused.end_reasons.tolist() == [0, 0, 1]
    wp.to_torch(fused.arrays.drones).fill_(7.0)
    assert worlds.state.drone[0].tolist() == [0.0, 0.0, 3.0]
    assert wp.to_torch(fused.poses.attitudes)[0].tolist() == [1.0, 0.0, 0.0, 0.0]


def test_other_rules_and_moves_are_unsupported():
    class Windy(ComputerVision):
        pass

    class Strict(CollectCubes):
        def step(self, state, body):
            return super().step(state, body)

    assert CollectCubes().fused_rules(ComputerVision(), 1) is not None
    assert CollectCubes().fused_rules(Windy(), 1) is None
    flight, velocities = DynamicsSettings(mode="simple_flight"), ActionSettings(kind="velocity")
    assert CollectCubes().fused_rules(Quadrotor(flight), 1) is not None
    assert CollectCubes().fused_rules(Quadrotor(flight, velocities), 1) is None
    assert Strict().fused_rules(ComputerVision(), 1) is None
    assert Pillars().fused_rules(ComputerVision(), 1) is None


def test_tasks_with_other_positions_or_obstacles_are_unsupported():
    class Raised(CollectCubes):
        def places(self, state):
            return super().places(state) + 1.0

    class Solid(CollectCubes):
        def obstacles(self, state):
            return Obstacles(self.places(state), (1.0, 1.0, 1.0))

    flight = DynamicsSettings(mode="simple_flight")
    assert Raised().fused_rules(ComputerVision(), 1) is None
    assert Solid().fused_rules(Quadrotor(flight), 1) is None
