import dataclasses
from typing import ClassVar

import pytest

from drone_rl.sim.settings import BaseTaskSettings, TaskSettings
from drone_rl.sim.tasks import CollectCubes, Pillars, PillarsSettings, registry
from drone_rl.sim.tasks.registry import as_task, read_task, register_task, settings_of
from drone_rl.utils.errors import InputError
from tests.second_task import Posts


@dataclasses.dataclass(frozen=True, kw_only=True)
class PostsSettings(BaseTaskSettings):
    name: ClassVar[str] = "posts"
    tall: bool = True


def test_settings_ask_for_their_task():
    assert isinstance(as_task(None), CollectCubes)
    assert as_task(TaskSettings(num_cubes=2)).settings.num_cubes == 2
    assert isinstance(as_task(PillarsSettings()), Pillars)
    task = Posts()
    assert as_task(task) is task
    with pytest.raises(InputError, match="PostsSettings is the settings of no task; call"):
        as_task(PostsSettings())


def test_a_user_s_task_is_known_once_it_is_registered(monkeypatch):
    monkeypatch.setattr(registry, "TASKS", dict(registry.TASKS))
    register_task(PostsSettings, lambda _: Posts())
    register_task(PostsSettings, lambda _: Posts())  # a module may be imported twice
    assert isinstance(as_task(PostsSettings()), Posts)
    assert read_task({"name": "posts", "tall": False}, "task") == PostsSettings(tall=False)

    class Other(PostsSettings):
        pass

    with pytest.raises(InputError, match="there is a task called posts; give another name"):
        register_task(Other, lambda _: Posts())


def test_plain_data_names_its_task_or_is_cube_collection():
    for settings in (TaskSettings(num_cubes=2), PillarsSettings(num_rows=3)):
        assert read_task(settings.values(), "task") == settings
    assert "name" not in TaskSettings().values()
    with pytest.raises(InputError, match="task.name='walls' is unknown; there are: collect_cubes"):
        read_task({"name": "walls"}, "task")
    with pytest.raises(InputError, match="task.'num_cubes' is unknown"):
        read_task({**PillarsSettings().values(), "num_cubes": 3}, "task")
    with pytest.raises(InputError, match="task.num_rows is missing"):
        read_task({"name": "pillars"}, "task")


@pytest.mark.parametrize("name", [3, None, ["pillars"], "pillars\n"])
def test_a_name_is_a_known_text(name):
    with pytest.raises(InputError, match="is unknown; there are"):
        settings_of(name)
