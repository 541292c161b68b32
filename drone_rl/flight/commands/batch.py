"""One command for many drones at once."""

import dataclasses
import math

import torch
from torch import Tensor

from drone_rl.config import DynamicsSettings
from drone_rl.flight.commands.command import PERIOD, Command
from drone_rl.sim.dynamics import FlightState, Obstacles, Quadrotor


@dataclasses.dataclass(frozen=True)
class Record:
    """What became of `num_worlds` drones."""

    times: Tensor  # (T,) float64
    """Seconds from when they were told."""
    states: list[FlightState]
    """Then; T of them."""
    done: Tensor  # (num_worlds,) int64
    """Which of them was the first in which a drone had done it; T where it never did."""

    @property
    def positions(self) -> Tensor:
        """Metres. Shape: (T, num_worlds, 3)."""
        return torch.stack([state.position for state in self.states])


def period_ticks(settings: DynamicsSettings) -> int:
    """Ticks of physics from one decision to the next: as few as make `PERIOD`."""
    return max(1, math.ceil(PERIOD / settings.tick - 1e-9))


def fly_command(
    quadrotor: Quadrotor,
    body: FlightState,
    command: Command,
    seconds: float,
    obstacles: Obstacles | None = None,
) -> Record:
    """Flies until all drones have done what they are told; those who have go on meanwhile.

    Args:
        quadrotor: What they are.
        body: Where they are.
        command: What they are told.
        seconds: After which it is over in any case.
        obstacles: What they may touch.
    """
    ticks = period_ticks(quadrotor.settings)
    step = ticks * quadrotor.settings.tick
    states = [body]
    command.begin(body)
    done = torch.full((len(body),), -1)
    most = int(min(seconds, command.limit) / step)
    while len(states) <= most and bool((done < 0).any()):
        body = quadrotor.fly(body, command.goals(body), ticks, obstacles)
        done = torch.where((done < 0) & command.is_complete(body), len(states), done)
        states.append(body)
    done = torch.where(done < 0, len(states), done)
    return Record(torch.arange(len(states), dtype=torch.float64) * step, states, done)
