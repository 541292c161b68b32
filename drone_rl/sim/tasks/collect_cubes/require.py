"""What is known of cube collection alone is asked of no other task."""

from drone_rl.sim.settings import BaseTaskSettings, TaskSettings
from drone_rl.utils.errors import InputError


def require_cubes(task: BaseTaskSettings, what: str) -> TaskSettings:
    """The task's settings, if it is cube collection.

    Args:
        task: Any task's.
        what: What is asked for, as a person would say it: "a proof".

    Raises:
        InputError: It is another task.
    """
    if not isinstance(task, TaskSettings):
        raise InputError(
            f"task.name={task.name}: {what} is known of {TaskSettings.name} alone; give a policy "
            "of that task"
        )
    return task
