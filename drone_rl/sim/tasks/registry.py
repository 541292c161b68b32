"""The tasks that there are, by the settings that ask for them."""

from collections.abc import Callable, Mapping
from typing import Any

from drone_rl.sim.settings import BaseTaskSettings, TaskSettings
from drone_rl.sim.tasks.collect_cubes import CollectCubes
from drone_rl.sim.tasks.pillars import Pillars, PillarsSettings
from drone_rl.sim.tasks.task import Task
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import as_mapping, shown

TASKS: dict[type[BaseTaskSettings], Callable[[Any], Task[Any]]] = {
    TaskSettings: CollectCubes,
    PillarsSettings: Pillars,
}
"""What makes the task of settings, by their class."""


def register_task(settings: type[BaseTaskSettings], make: Callable[[Any], Task[Any]]) -> None:
    """Makes a task known, to files too.

    Args:
        settings: The class of its settings, whose `name` files give.
        make: Takes such settings.

    Raises:
        InputError: Another one has its name.
    """
    if any(known.name == settings.name and known is not settings for known in TASKS):
        raise InputError(f"there is a task called {settings.name}; give another name")
    TASKS[settings] = make


def as_task(task: BaseTaskSettings | Task[Any] | None) -> Task[Any]:
    """The task of some settings; the original study's by default.

    Raises:
        InputError: Nothing is known to make it.
    """
    task = TaskSettings() if task is None else task
    if not isinstance(task, BaseTaskSettings):
        return task
    if type(task) not in TASKS:
        raise InputError(
            f"{type(task).__name__} is the settings of no task; call drone_rl.sim.tasks."
            "register_task with what makes it"
        )
    return TASKS[type(task)](task)


def settings_of(name: object, where: str = "task.name") -> type[BaseTaskSettings]:
    """The class of a task's settings.

    Args:
        name: The task's.
        where: Its place, for people.

    Raises:
        InputError: There is none of that name.
    """
    named = {settings.name: settings for settings in TASKS}
    if not isinstance(name, str) or name not in named:
        raise InputError(f"{where}={shown(name)} is unknown; there are: {', '.join(named)}")
    return named[name]


def read_task(data: Any, where: str) -> BaseTaskSettings:
    """Settings of a task out of plain data that has every field and no other.

    Args:
        data: A mapping; without a name it is cube collection.
        where: Its name, for people.

    Raises:
        InputError: See `Settings.read`.
    """
    cls, given = named_settings(data, where)
    return cls.read(given, where)


def named_settings(data: Any, where: str) -> tuple[type[BaseTaskSettings], Mapping[str, Any]]:
    """The class of a task's settings, and what else is given of them.

    Raises:
        InputError: There is no such task.
    """
    given = dict(as_mapping(data, where))
    return settings_of(given.pop("name", TaskSettings.name), f"{where}.name"), given
