"""Tasks of a user: defaults, both simulators, TorchRL, and the registry."""

import dataclasses
from typing import ClassVar
from unittest.mock import patch

import pytest
import torch
from tensordict import TensorDict
from torchrl.envs.utils import check_env_specs

from drone_rl.config import TASKS, BaseTaskSettings, PillarsSettings, TaskSettings
from drone_rl.envs import DroneEnv
from drone_rl.sim.composer_task import make_environment
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.tasks import CollectCubes, EndReason, Pillars, Task
from drone_rl.sim.tasks.task import as_settings, as_task, register_task
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError
from tests.composer_env import ComposerEnv
from tests.second_task import Posts


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
    assert task.vocabulary.goals == "goals"
    assert task.edits is None
    env.close()


class PostsSettings(BaseTaskSettings):
    name: ClassVar[str] = "posts"
    tall: bool = True


def test_invalid_settings_raise():
    assert isinstance(as_task(None), CollectCubes)
    assert as_task(TaskSettings(num_cubes=2)).settings.num_cubes == 2
    assert isinstance(as_task(PillarsSettings()), Pillars)
    task = Posts()
    assert as_task(task) is task
    assert isinstance(as_task("pillars"), Pillars)
    assert as_task("collect_cubes").settings == TaskSettings()
    with pytest.raises(InputError, match="task='pillar': it must be one of collect_cubes, p"):
        as_task("pillar")
    with pytest.raises(InputError, match=r"task=\(dict\) is no task; give one of collect_cubes"):
        as_task({"num_cubes": 1})
    with pytest.raises(InputError, match="PostsSettings is the settings of no task; call"):
        as_task(PostsSettings())


def test_user_tasks_can_be_registered():
    register_task(PostsSettings, lambda _: Posts())
    register_task(PostsSettings, lambda _: Posts())  # a module may be imported twice
    assert isinstance(as_task(PostsSettings()), Posts)
    assert BaseTaskSettings.read({"name": "posts", "tall": False}, "task") == PostsSettings(
        tall=False
    )

    class Other(PostsSettings):
        pass

    with pytest.raises(InputError, match="there is a task called posts; give another name"):
        register_task(Other, lambda _: Posts())


class WithText(BaseTaskSettings):
    name: ClassVar[str] = "mine"
    cost: float = "0.005"


def test_mistakes_in_settings_are_named_when_their_task_is_registered():
    settings, message = WithText, r"^WithText\.cost='0\.005': it must be a valid number$"
    with pytest.raises(InputError, match=message):
        register_task(settings, lambda _: Posts())
    assert "mine" not in TASKS


def test_tasks_without_settings_are_registered_as_objects():
    settings, again = as_settings(Posts()), Posts()
    assert BaseTaskSettings.read({"name": "posts"}, "task") == settings == as_settings(settings)
    assert isinstance(as_task(settings), Posts)
    register_task(again)  # a cell of a notebook ran twice
    assert as_task(settings) is again
    two_cubes = TaskSettings(num_cubes=2)
    assert as_settings(CollectCubes(two_cubes)) == two_cubes

    class Variant(CollectCubes):
        pass

    with pytest.raises(InputError, match="there is a task called collect_cubes; give another"):
        as_settings(Variant())
    for wrong in ((PostsSettings,), (Posts, PostsSettings), (PostsSettings, 5)):
        with pytest.raises(InputError, match="make no task; give a task, or the class of its"):
            register_task(*wrong)


def test_tasks_and_settings_need_a_name():
    class Unnamed(BaseTaskSettings):
        pass

    with pytest.raises(InputError, match='Unnamed has no name; add name = "my_task" to the class'):
        register_task(Unnamed, lambda _: Posts())
    nameless = type("Nameless", (Posts,), {})()
    with patch.object(Posts, "name", create=True), pytest.raises(InputError, match="Nameless has"):
        del Posts.name
        register_task(nameless)
