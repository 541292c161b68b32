"""Refuse policies that verification does not support."""

from drone_rl.config import TaskSettings
from drone_rl.policies.zoo import PolicyDescription
from drone_rl.utils.errors import InputError


def require_cubes(described: PolicyDescription, what: str) -> TaskSettings:
    """Return the task of a policy that verification supports; `what` needs it, such as "proofs".

    Raises:
        InputError: The task is not cube collection by the three moves of computer-vision mode, or a
            position of the drone does not determine the observation.
    """
    task, dynamics, actions = described.task, described.dynamics, described.actions
    if not isinstance(task, TaskSettings):
        raise InputError(
            f"{what} support only task={TaskSettings.name}, got task={task.name}; give a policy of "
            "that task"
        )
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
    if any(choice.name == "stack" for choice in described.transforms):
        raise InputError(
            f"{what} support only policies that observe one frame; this one stacks frames "
            "(transform stack)"
        )
    if described.faults:
        raise InputError(
            f"{what} support only cameras without faults; this policy's simulates faults "
            f"(transform {described.faults[0]})"
        )
    return task
