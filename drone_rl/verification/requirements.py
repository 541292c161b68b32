"""Refuse policies that verification does not support."""

import math

import torch

from drone_rl.config import TaskSettings
from drone_rl.envs import CameraFault, Pipeline
from drone_rl.policies.zoo import PolicyDescription
from drone_rl.utils.errors import InputError


def require_cubes(described: PolicyDescription, what: str) -> TaskSettings:
    """Return the task of a policy that verification supports.

    `what` is the subject of the error message, such as "proofs".

    Raises:
        InputError: The task is not cube collection by the three moves of computer-vision mode, or a
            position of the drone does not determine the observation.
    """
    task, dynamics = described.task.parameters, described.dynamics
    actions = described.actions.settings
    remedy = "give another policy"
    if type(task) is not TaskSettings:  # a task of a derived class may have other rules
        problem = f"task={TaskSettings.name}, got task={task.name}"
    elif not dynamics.is_computer_vision:
        problem = f"dynamics=computer_vision, got dynamics.mode={dynamics.mode}"
        remedy = "leave dynamics out or give another policy"
    elif actions.kind != "moves":
        problem = f"actions=moves, got actions.kind={actions.kind}"
    elif not (problem := _ambiguity(described)):
        return task
    raise InputError(f"{what} support only {problem}; {remedy}")


def _ambiguity(described: PolicyDescription) -> str:
    """Return what is supported if one position can have several observations, else nothing."""
    if any(choice.name == "stack" for choice in described.transforms):
        return "policies that observe one frame; this one stacks frames (transform stack)"
    if described.is_recurrent:
        return "policies that observe one frame; this one remembers earlier ones (network=lstm)"
    if described.faults:
        return f"cameras without faults; it simulates faults (transform {described.faults[0]})"
    if described.appearance.varies:
        return "appearances without ranges; this policy's differs between episodes"
    made, camera = described.make_transforms(), described.camera  # also the user's own
    shape = (2, camera.height, camera.width, 3)
    images = (torch.arange(math.prod(shape)) % 255).to(torch.uint8).reshape(shape)
    first, second = (Pipeline(made)(images) for _ in range(2))
    if any(isinstance(one, CameraFault) for one in made) or not torch.equal(first, second):
        return "transforms without chance; those of this policy may change an image at random"
    return ""
