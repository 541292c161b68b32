"""What moves drones, made of what was chosen about how they move and what they can be asked for."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
import torch
from torch import Tensor

from drone_rl.config import COMPUTER_VISION, MOVES_SETTINGS, ActionSettings, DynamicsSettings
from drone_rl.sim.dynamics.dynamics import Dynamics
from drone_rl.sim.dynamics.kinematic import Kinematic
from drone_rl.sim.dynamics.quadrotor import Quadrotor
from drone_rl.utils.errors import InputError

_SEEDS = 2**31 - 1
"""How many different episodes of random dynamics there are."""


class HasMoves(Protocol):
    """A task, as far as it says how drones move unless the user wants otherwise."""

    def make_dynamics(self) -> Dynamics:
        """In computer-vision mode, by moves."""
        ...


def make_dynamics(
    task: HasMoves,
    dynamics: DynamicsSettings | Dynamics | None = None,
    actions: ActionSettings | None = None,
) -> Dynamics:
    """How drones move.

    Args:
        task: Whose own choice holds where actions set poses and are moves.
        dynamics: Computer-vision mode by default; something that moves drones is taken as it is.
        actions: Moves by default.

    Raises:
        InputError: Actions are chosen for what brings its own.
    """
    if dynamics is not None and not isinstance(dynamics, DynamicsSettings):
        if actions is not None:
            raise InputError(
                f"actions={actions.kind}, but dynamics={type(dynamics).__name__} brings its own; "
                "give settings of dynamics, or no actions"
            )
        return dynamics
    dynamics, actions = dynamics or COMPUTER_VISION, actions or MOVES_SETTINGS
    if not dynamics.is_computer_vision:
        return Quadrotor(dynamics, actions)
    if actions.kind == "moves":
        return task.make_dynamics()
    return Kinematic(actions, dynamics.control_timestep)


def draw_seeds(random_states: Sequence[np.random.RandomState]) -> Tensor:
    """One for each episode, see `Dynamics.start`; drawn after all that the task draws.

    Args:
        random_states: Of the episodes' worlds.

    Returns:
        Shape: (number of episodes,), int64.
    """
    return torch.tensor([int(r.randint(_SEEDS)) for r in random_states], dtype=torch.int64)
