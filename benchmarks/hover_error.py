"""How far from its place a hovering drone is blown."""

import dataclasses

import torch

from drone_rl.config import DynamicsSettings
from drone_rl.flight.commands.command import fly_command
from drone_rl.flight.commands.movement import Hover
from drone_rl.sim.dynamics import Quadrotor


@dataclasses.dataclass(frozen=True)
class HoverError:
    """Distances from where drones were told to stay, metres."""

    mean: float
    """Once blown there: over the second half of the time."""
    greatest: float
    """Of all the time."""


def hover_error(
    settings: DynamicsSettings, *, seconds: float = 30.0, num_drones: int = 8, seed: int = 0
) -> HoverError:
    """Hovers 5 m above the ground, from a start at rest in moving air.

    Args:
        settings: Drone and air.
        seconds: How long.
        num_drones: How many, each with gusts of its own.
        seed: Of the first one's; the others' follow.
    """
    quadrotor = Quadrotor(settings)
    place = torch.tensor([[0.0, 0.0, 5.0]], dtype=torch.float64).repeat(num_drones, 1)
    body = quadrotor.start(place, torch.arange(seed, seed + num_drones))
    away = (fly_command(quadrotor, body, Hover(seconds), seconds).positions - place).norm(dim=-1)
    return HoverError(float(away[len(away) // 2 :].mean()), float(away.max()))
