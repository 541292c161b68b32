"""Refuse tasks, dynamics and actions that verification does not support."""

from drone_rl.config import ActionSettings, BaseTaskSettings, DynamicsSettings, TaskSettings
from drone_rl.utils.errors import InputError


def require_cubes(task: BaseTaskSettings, what: str) -> TaskSettings:
    """Return the settings of cube collection.

    Args:
        task: Settings of any task.
        what: What needs it, plural, such as "proofs".

    Raises:
        InputError: It is another task.
    """
    if not isinstance(task, TaskSettings):
        raise InputError(
            f"{what} support only task={TaskSettings.name}, got task={task.name}; give a policy of "
            "that task"
        )
    return task


def require_moves(dynamics: DynamicsSettings, actions: ActionSettings, what: str) -> None:
    """Refuse other motion than the three moves of computer-vision mode.

    Args:
        dynamics: Settings of the vehicle dynamics.
        actions: Settings of the actions.
        what: See `require_cubes`.

    Raises:
        InputError: The drone has dynamics, or other actions.
    """
    if not dynamics.is_computer_vision:
        raise InputError(
            f"{what} support only dynamics=computer_vision, got dynamics.mode={dynamics.mode}; "
            "give a policy trained with it"
        )
    if actions.kind != "moves":
        raise InputError(
            f"{what} support only actions=moves, got actions.kind={actions.kind}; give a policy "
            "trained with it"
        )
