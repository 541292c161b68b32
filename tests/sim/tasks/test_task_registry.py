from typing import Annotated, ClassVar
from unittest.mock import patch

import pytest

from drone_rl.config import TASKS, BaseTaskSettings, PillarsSettings, TaskSettings, read_task
from drone_rl.sim.tasks import CollectCubes, Pillars
from drone_rl.sim.tasks.task import MAKERS, as_settings, as_task, register_task
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Real
from tests.second_task import Posts


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
    with pytest.raises(InputError, match="task='pillar' is unknown; valid names: collect_cubes, p"):
        as_task("pillar")
    with pytest.raises(InputError, match=r"task=\(dict\) is no task; give one of collect_cubes"):
        as_task({"num_cubes": 1})
    with pytest.raises(InputError, match="PostsSettings is the settings of no task; call"):
        as_task(PostsSettings())


def test_user_tasks_can_be_registered(monkeypatch):
    monkeypatch.setitem(MAKERS, PostsSettings, None)  # removed after the test
    monkeypatch.setitem(TASKS, "posts", PostsSettings)
    register_task(PostsSettings, lambda _: Posts())
    register_task(PostsSettings, lambda _: Posts())  # a module may be imported twice
    assert isinstance(as_task(PostsSettings()), Posts)
    assert read_task({"name": "posts", "tall": False}, "task") == PostsSettings(tall=False)

    class Other(PostsSettings):
        pass

    with pytest.raises(InputError, match="there is a task called posts; give another name"):
        register_task(Other, lambda _: Posts())


class WithoutDefault(BaseTaskSettings):
    name: ClassVar[str] = "mine"
    cost: Annotated[float, Real(0.0)]


class WithText(BaseTaskSettings):
    name: ClassVar[str] = "mine"
    cost: float = "0.005"


class WithUnion(BaseTaskSettings):
    name: ClassVar[str] = "mine"
    cost: int | str = 3


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (WithoutDefault, r"^WithoutDefault\.cost has no default; give it one"),
        (WithText, r"^WithText\.cost='0\.005' is a text; give a finite number$"),
        (WithUnion, r"^WithUnion\.cost is of type int \| str; annotate it with a kind"),
    ],
)
def test_mistakes_in_settings_are_named_when_their_task_is_registered(settings, message):
    with pytest.raises(InputError, match=message):
        register_task(settings, lambda _: Posts())
    assert "mine" not in TASKS


def test_tasks_without_settings_are_registered_as_objects():
    with patch.dict(TASKS), patch.dict(MAKERS):
        settings, again = as_settings(Posts()), Posts()
        assert read_task({"name": "posts"}, "task") == settings == as_settings(settings)
        assert isinstance(as_task(settings), Posts)
        register_task(again)  # a cell of a notebook ran twice
        assert as_task(settings) is again
        two_cubes = TaskSettings(num_cubes=2)
        assert as_settings(CollectCubes(two_cubes)) == two_cubes

        class Variant(CollectCubes):
            pass

        with pytest.raises(InputError, match="there is a task called collect_cubes; give another"):
            as_settings(Variant())
        with pytest.raises(InputError, match=r"None makes no task; .* as in register_task\(PostsS"):
            register_task(PostsSettings)
        with pytest.raises(InputError, match="Posts is no class of settings; give it first"):
            register_task(Posts, PostsSettings)
        with pytest.raises(InputError, match="5 makes no task; give what makes the task"):
            register_task(PostsSettings, 5)
    assert "posts" not in TASKS


def test_tasks_and_settings_need_a_name():
    class Unnamed(BaseTaskSettings):
        pass

    with pytest.raises(InputError, match='Unnamed has no name; add name = "my_task" to the class'):
        register_task(Unnamed, lambda _: Posts())
    nameless = type("Nameless", (Posts,), {})()
    with patch.object(Posts, "name", create=True), pytest.raises(InputError, match="Nameless has"):
        del Posts.name
        register_task(nameless)
