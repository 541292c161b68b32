"""User-defined tasks work in both simulators and in TorchRL."""

import dataclasses

import pytest
import torch
from tensordict import TensorDict
from torchrl.envs.utils import check_env_specs

from drone_rl.config import TaskSettings
from drone_rl.envs import DroneEnv
from drone_rl.sim.composer_task import make_environment
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.tasks import CollectCubes, EndReason, Task, as_task
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import world_random_state
from tests.composer_env import ComposerEnv
from tests.second_task import End, Posts


def test_default_settings_select_cube_collection():
    assert isinstance(as_task(None), CollectCubes)
    assert as_task(TaskSettings(num_cubes=2)).settings.num_cubes == 2
    task = Posts()
    assert as_task(task) is task


def test_both_simulators_give_the_same_episodes():
    env = make_environment(Posts(), pixels=False, random_state=world_random_state(3, 0))
    worlds = Worlds(1, Posts())
    stream, ends = world_random_state(3, 0), set()
    for actions in ([0] * 9, [1, 0, 0, 0, 0, 0], [2, 0, 0, 0, 0, 0], [1, 2] * 6):
        timestep = env.reset()
        worlds.reset(torch.arange(1), [stream])
        for action in actions:
            timestep = env.step(action)
            reward = worlds.step(torch.arange(1), torch.tensor([action]))
            assert timestep.reward == reward.item()
            assert torch.equal(env.task.state.posts, worlds.state.posts)
            assert timestep.observation["passed"].tolist() == worlds.state.passed[0].tolist()
            if timestep.last():
                break
        end = End(worlds.state.end_reason.item())
        assert timestep.last() == (end != End.RUNNING)
        assert timestep.discount == (0.0 if end in (End.THROUGH, End.TOUCHED) else 1.0)
        ends.add(end)
    assert ends == {End.THROUGH, End.TOUCHED, End.TIME}
    worlds.close()


def test_props_are_rendered_with_their_semantic_classes():
    worlds = Worlds(1, Posts())
    state = worlds.start(torch.tensor([[1.0, -1.0]], dtype=torch.float64))
    seen = worlds.render(state, worlds.view(modality="segmentation"))[0]
    props = torch.tensor([*worlds.scene.props, -1])[seen.long()]
    columns = [(props == i).any(0).nonzero()[:, 0] for i in range(2)]
    assert columns[0].max() < 32 <= columns[1].min()  # the first left, the second right
    assert [m.name for m in worlds.scene.semantic_classes].count("OBSTACLE") == 2
    assert not worlds.scene.geoms(SemanticClass.TARGET)
    worlds.close()


def test_torchrl_specs_follow_the_task():
    env = DroneEnv(4, Posts(), pixels=False)
    check_env_specs(env)
    assert set(env.observation_spec["info"].keys()) == {
        "passed", "sides", "end_reason", "posts", "drone", "attitude",
    }  # fmt: skip
    straight = env.rollout(12, policy=lambda td: td.set("action", torch.zeros(4).long()))
    assert straight["next", "reward"].sum(1).tolist() == [[2.0]] * 4
    assert straight["next", "terminated"][:, -1].all() and straight.shape[1] == 7
    env.reset()
    turns = iter([1, 2] * 6)
    waiting = env.rollout(20, policy=lambda td: td.set("action", torch.full((4,), next(turns))))
    assert waiting["next", "truncated"][:, -1].all() and waiting.shape[1] == 12
    env.close()
    check_env_specs(ComposerEnv(make_environment(Posts(), pixels=False, random_state=0)))


class Minimal(Task):
    name = "minimal"

    def sample(self, random_state):
        return torch.from_numpy(random_state.uniform(size=2))

    def step(self, state, body):
        end = (body.position[:, 0] > state.sampled[:, 0]).long() * EndReason.SUCCESS
        steps = state.steps + 1
        return dataclasses.replace(state, body=body, steps=steps, end_reason=end), end.double()


class Single(Minimal):
    name = "single"

    def sample(self, random_state):
        return super().sample(random_state).float()


@pytest.mark.parametrize("task", [None, Single(), Posts()])
def test_a_reset_leaves_earlier_information_alone(task):
    env = DroneEnv(2, task, pixels=False)
    before = env.step(env.rand_action(env.reset()))["next", "info"]
    kept = before.clone()
    env.reset(TensorDict({"_reset": torch.tensor([[True], [False]])}, [2]))
    for name, value in kept.items():
        assert torch.equal(before[name].nan_to_num(), value.nan_to_num()), name
    env.close()


def test_base_class_has_defaults():
    env = DroneEnv(3, Minimal(), pixels=False)
    check_env_specs(env)
    step = env.rollout(5, policy=lambda td: td.set("action", torch.zeros(3).long()))
    info = step["next", "info"]
    assert step.shape[1] == 1 and step["next", "terminated"].all()
    task = Minimal()
    reasons = task.entries["end_reason"]
    assert (reasons.low, reasons.high) == (0, EndReason.STEP_LIMIT)
    goals = task.score({name: info[name][:, 0] for name in task.scored})
    assert goals.reached.all() and goals.world.shape == (3, 2)
    one = {**{name: info[name][:, 0] for name in task.scored}, "sampled": torch.zeros(3)}
    assert task.score(one).world.shape == (3, 1)  # of a single number
    (by, value, of) = next(iter(task.classes(goals)))
    assert (by, value) == ("side", "anywhere") and of.all()
    assert task.vocabulary.goals == "goals" and task.fused_rules(task.make_dynamics(), 3) is None
    with pytest.raises(InputError, match="task=minimal cannot be explained; define next_target in"):
        task.next_target(env.worlds.state)
    env.close()
