"""The tasks that there are, by name: what files and the command line can ask for."""

from collections.abc import Mapping
from typing import Any

from drone_rl.config.cubes import TaskSettings
from drone_rl.config.pillars import PillarsSettings
from drone_rl.config.task import FIRST, BaseTaskSettings
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import as_mapping, shown

TASKS: dict[str, type[BaseTaskSettings]] = {
    settings.name: settings for settings in (TaskSettings, PillarsSettings)
}
"""The class of a task's settings; more are added by `drone_rl.sim.tasks.register_task`."""


def settings_of(name: object, where: str = "task.name") -> type[BaseTaskSettings]:
    """The class of a task's settings.

    Args:
        name: The task's.
        where: Its place, for people.

    Raises:
        InputError: There is none of that name.
    """
    if not isinstance(name, str) or name not in TASKS:
        raise InputError(f"{where}={shown(name)} is unknown; there are: {', '.join(TASKS)}")
    return TASKS[name]


def named_settings(data: Any, where: str) -> tuple[type[BaseTaskSettings], Mapping[str, Any]]:
    """The class of a task's settings, and what else is given of them.

    Args:
        data: A mapping; without a name it is of the first task.
        where: Its name, for people.

    Raises:
        InputError: There is no such task.
    """
    given = dict(as_mapping(data, where))
    return settings_of(given.pop("name", FIRST), f"{where}.name"), given


def read_task(data: Any, where: str) -> BaseTaskSettings:
    """Settings of a task out of plain data that has every field and no other.

    Args:
        data: See `named_settings`.
        where: Its name, for people.

    Raises:
        InputError: See `Settings.read`.
    """
    cls, given = named_settings(data, where)
    return cls.read(given, where)
