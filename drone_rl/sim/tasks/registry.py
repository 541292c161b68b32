"""The tasks that settings and files name."""

from collections.abc import Callable
from typing import Any

from drone_rl.config import TASKS, BaseTaskSettings, PillarsSettings, TaskSettings, settings_of
from drone_rl.sim.tasks.collect_cubes import CollectCubes
from drone_rl.sim.tasks.pillars import Pillars
from drone_rl.sim.tasks.task import Task
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import shown

MAKERS: dict[type[BaseTaskSettings], Callable[[Any], Task[Any]]] = {
    TaskSettings: CollectCubes,
    PillarsSettings: Pillars,
}
"""By the class of its settings."""


def register_task(settings: type[BaseTaskSettings], make: Callable[[Any], Task[Any]]) -> None:
    """Register a task by the class of its settings and a function that takes such settings.

    Raises:
        InputError: Another task has its name.
    """
    if TASKS.get(settings.name, settings) is not settings:
        raise InputError(f"there is a task called {settings.name}; give another name")
    TASKS[settings.name], MAKERS[settings] = settings, make


def as_task(task: BaseTaskSettings | Task[Any] | str | None) -> Task[Any]:
    """Return the task of settings or of a name such as "pillars"; cube collection by default.

    Raises:
        InputError: The task is unknown.
    """
    task = TaskSettings() if task is None else task
    if isinstance(task, str):
        task = settings_of(task, "task")()
    if not isinstance(task, BaseTaskSettings):
        if not isinstance(task, Task):
            raise InputError(
                f"task={shown(task)} is no task; give one of {', '.join(TASKS)}, settings such as "
                "drone_rl.TaskSettings(num_cubes=2), or a task of your own"
            )
        return task
    if type(task) not in MAKERS:
        raise InputError(
            f"{type(task).__name__} is the settings of no task; call drone_rl.sim.tasks."
            "register_task with what makes it"
        )
    return MAKERS[type(task)](task)
