"""Errors of path following, and of hovering in wind."""

import dataclasses
import math
from typing import Any

import torch

from benchmarks.benchmark import Setup
from drone_rl.config import DynamicsSettings
from drone_rl.flight.commands.command import Command, Hover, period_ticks
from drone_rl.flight.commands.path_following import Path, PathCommand, braking_time
from drone_rl.sim.dynamics import FlightState, Quadrotor

HEIGHT = 5.0
"""Height of the first point of paths in metres."""


def square_error(side: float = 10.0, speed: float = 2.0) -> tuple[float, float]:
    """Fly around a square with automatic lookahead, starting from a hover at a corner.

    Args:
        side: Side of the square, metres.
        speed: Commanded speed, m/s.

    Returns:
        Mean distance from the path over time, metres, and the time until its end, seconds;
        infinite if the end is not reached.
    """
    quadrotor = Quadrotor(DynamicsSettings(mode="simple_flight"))
    corners = [(0, 0), (side, 0), (side, side), (0, side), (0, 0)]
    points = [(x, y, HEIGHT) for x, y in corners]
    body = quadrotor.start(torch.tensor(points[:1], dtype=torch.float64))
    braking = braking_time(quadrotor.settings)
    command = PathCommand(body, points[1:], speed, 3.0 * 4 * side / speed + 20.0, braking=braking)
    states, end = fly_command(quadrotor, body, command)
    path = Path(points)
    distances = [path.distance_from(state.position[0]) for state in states[: end + 1]]
    step = period_ticks(quadrotor.settings) * quadrotor.settings.tick
    seconds = end * step if end < len(states) else math.inf
    return sum(distances) / len(distances), seconds


@dataclasses.dataclass(frozen=True)
class HoverError:
    """Distances from the commanded position, metres."""

    mean: float
    """Mean over the second half of the time."""
    greatest: float
    """Largest distance over all the time."""


def hover_error(settings: DynamicsSettings, *, seconds: float = 30.0, seed: int = 0) -> HoverError:
    """Hover 5 m above the ground, starting at rest in moving air.

    Args:
        settings: Settings of drone and air.
        seconds: Duration.
        seed: Seed of the gusts.
    """
    quadrotor = Quadrotor(settings)
    place = torch.tensor([[0.0, 0.0, 5.0]], dtype=torch.float64)
    body = quadrotor.start(place, torch.tensor([seed]))
    states, _ = fly_command(quadrotor, body, Hover(body, seconds))
    distances = (torch.stack([state.position for state in states]) - place).norm(dim=-1)
    return HoverError(float(distances[len(distances) // 2 :].mean()), float(distances.max()))


WIND = 5.0
"""Wind speed of the hover test, m/s."""
_DIRECTIONS = 8
"""Number of wind directions."""


def bench_flight_paths(setup: Setup) -> dict[str, Any]:
    """Measure path following and hovering of the default drone; one wind direction if quick.

    Returns:
        "path_error_m": mean distance from a square of 10 m at 2 m/s; "path_s": its time;
        "hover_error_m": steady-state mean distance of a hovering drone from its position in wind
        of 5 m/s, for the worst direction; "hover_greatest_m": the largest distance at any time.
    """
    errors = [_wind_error(number) for number in range(1 if setup.quick else _DIRECTIONS)]
    distance, seconds = square_error()
    return {
        "path_error_m": distance,
        "path_s": seconds,
        "hover_error_m": max(error.mean for error in errors),
        "hover_greatest_m": max(error.greatest for error in errors),
    }


def _wind_error(number: int) -> HoverError:
    angle = 2.0 * math.pi * number / _DIRECTIONS
    wind = (WIND * math.cos(angle), WIND * math.sin(angle), 0.0)
    return hover_error(DynamicsSettings(mode="simple_flight", wind=wind))


def fly_command(
    quadrotor: Quadrotor, body: FlightState, command: Command, seconds: float = math.inf
) -> tuple[list[FlightState], int]:
    """Run a command of one drone until it is complete.

    It ends after `seconds`, or the command's own limit, at the latest.

    Returns:
        The state at the start and after each of T - 1 control periods, and the index of the one at
        which the command was complete; T if it never was.
    """
    ticks = period_ticks(quadrotor.settings)
    states = [body]
    most = int(min(seconds, command.limit) / (ticks * quadrotor.settings.tick))
    while len(states) <= most:
        states.append(quadrotor.fly(states[-1], command.goals(states[-1]), ticks))
        if command.is_complete(states[-1]):
            return states, len(states) - 1
    return states, len(states)
