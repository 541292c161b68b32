"""What is known of cube collection by moves alone is asked of nothing else."""

from drone_rl.config import ActionSettings, BaseTaskSettings, DynamicsSettings, TaskSettings
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


def require_moves(dynamics: DynamicsSettings, actions: ActionSettings, what: str) -> None:
    """Makes sure that a drone goes from place to place by the chapter's three moves.

    Args:
        dynamics: How it moves.
        actions: What it can be asked for.
        what: What is asked for, see `require_cubes`.

    Raises:
        InputError: It flies, or its actions are others.
    """
    if not dynamics.is_computer_vision:
        raise InputError(
            f"dynamics.mode={dynamics.mode}: {what} is known of computer-vision mode alone; give a "
            "policy that was trained with dynamics=computer_vision"
        )
    if actions.kind != "moves":
        raise InputError(
            f"actions.kind={actions.kind}: {what} is known of moves alone; give a policy that was "
            "trained with actions=moves"
        )
