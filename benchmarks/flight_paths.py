"""Errors of path following, and of hovering in wind."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import torch
from torch import Tensor

from benchmarks.benchmark import Setup
from drone_rl.config import DynamicsSettings
from drone_rl.flight.commands.command import Command, Hover, period_ticks
from drone_rl.flight.commands.path_following import (
    PathCommand,
    braking_time,
    distance_from,
    make_paths,
)
from drone_rl.sim.dynamics import FlightState, Obstacles, Quadrotor

HEIGHT = 5.0
"""Height of the first point of paths in metres."""


@dataclasses.dataclass(frozen=True)
class Course:
    """A path and a speed."""

    points: Tensor  # (P, 3) float64
    """Points relative to the first one, metres."""
    speed: float
    """Speed in m/s."""

    @property
    def length(self) -> float:
        """Length in metres."""
        return float(self.points.diff(dim=0).norm(dim=-1).sum())


@dataclasses.dataclass(frozen=True)
class Following:
    """Errors of a flight along a course."""

    length: float
    """Length of the path, metres."""
    speed: float
    """Commanded speed, m/s."""
    mean: float
    """Mean distance from the path over time, metres."""
    greatest: float
    """Largest distance from the path, metres."""
    seconds: float
    """Time from the first command to the end of the path; infinite if the end is not reached."""


def square(side: float = 10.0) -> Tensor:
    """Return a closed square. Shape: (5, 3)."""
    return _flat([(0, 0), (side, 0), (side, side), (0, side), (0, 0)])


def figure_eight(width: float = 20.0, points: int = 64) -> Tensor:
    """Return Gerono's lemniscate, starting at its center. Shape: (points + 1, 3)."""
    turn = torch.linspace(0.0, 2.0 * math.pi, points + 1, dtype=torch.float64)
    half = 0.5 * width
    return torch.stack([half * turn.sin(), half * turn.sin() * turn.cos(), 0.0 * turn], -1)


def helix(radius: float = 5.0, climb: float = 10.0, turns: int = 2, points: int = 64) -> Tensor:
    """Return an ascending helix. Shape: (points + 1, 3)."""
    turn = torch.linspace(0.0, 2.0 * math.pi * turns, points + 1, dtype=torch.float64)
    height = torch.linspace(0.0, climb, points + 1, dtype=torch.float64)
    return torch.stack([radius * turn.sin(), radius * (1.0 - turn.cos()), height], -1)


def zigzag(teeth: int = 6, step: float = 5.0, width: float = 5.0) -> Tensor:
    """Return a zigzag line. Shape: (teeth + 1, 3)."""
    return _flat([(step * i, width * (i % 2)) for i in range(teeth + 1)])


def straight(length: float = 100.0) -> Tensor:
    """Return a straight line. Shape: (2, 3)."""
    return _flat([(0, 0), (length, 0)])


def staircase(steps: int = 4, step: float = 3.0) -> Tensor:
    """Return steps that alternate between forward and up. Shape: (2 * steps + 1, 3)."""
    places = [(step * ((i + 1) // 2), 0.0, step * (i // 2)) for i in range(2 * steps + 1)]
    return torch.tensor(places, dtype=torch.float64)


def courses() -> dict[str, Course]:
    """Return the published courses by name."""
    return {
        "square": Course(square(), 2.0),
        "figure_eight": Course(figure_eight(), 2.0),
        "helix": Course(helix(), 2.0),
        "zigzag": Course(zigzag(), 2.0),
        "straight": Course(straight(), 5.0),
        "staircase": Course(staircase(), 1.0),
    }


def path_following(
    paths: Mapping[str, Course] | None = None, settings: DynamicsSettings | None = None
) -> dict[str, Following]:
    """Fly courses with automatic lookahead, starting from a hover at their first points.

    Args:
        paths: Courses by name; `courses()` by default.
        settings: Settings of drone and air; the default drone in still air by default.
    """
    chosen = paths or courses()
    quadrotor = Quadrotor(settings or DynamicsSettings(mode="simple_flight"))
    points = stack_paths([course.points for course in chosen.values()])
    points[..., 2] += HEIGHT
    speeds = torch.tensor([course.speed for course in chosen.values()], dtype=torch.float64)
    limit = max(3.0 * course.length / course.speed + 20.0 for course in chosen.values())
    braking, body = braking_time(quadrotor.settings), quadrotor.start(points[:, 0].clone())
    command = PathCommand(body, points[:, 1:], speeds, limit, braking=braking)
    states, done = fly_command(quadrotor, body, command)
    positions = torch.cat([state.position for state in states])
    followed = make_paths(points.repeat(len(states), 1, 1))
    distances = distance_from(followed, positions).view(len(states), -1)
    step = period_ticks(quadrotor.settings) * quadrotor.settings.tick
    times = torch.arange(len(states), dtype=torch.float64) * step
    return {
        name: _following(course, times, distances[:, number], int(done[number]))
        for number, (name, course) in enumerate(chosen.items())
    }


def _following(course: Course, times: Tensor, distances: Tensor, done: int) -> Following:
    """Return the errors of one course from the distance at each time until the course is done."""
    until = distances[: done + 1]
    seconds = float(times[done]) if done < len(times) else math.inf
    return Following(course.length, course.speed, float(until.mean()), float(until.max()), seconds)


def _flat(places: list[tuple[float, float]]) -> Tensor:
    return torch.tensor([(*place, 0.0) for place in places], dtype=torch.float64)


def stack_paths(paths: Sequence[Tensor]) -> Tensor:
    """Stack paths with different numbers of points; shorter ones repeat their last point.

    Args:
        paths: Points of each path. Shapes: (P, 3).
    """
    most = max(map(len, paths))
    rows = [torch.cat([p, p[-1:].expand(most - len(p), 3)]) for p in paths]
    return torch.stack(rows).double()


@dataclasses.dataclass(frozen=True)
class HoverError:
    """Distances from the commanded position, metres."""

    mean: float
    """Mean over the second half of the time."""
    greatest: float
    """Largest distance over all the time."""


def hover_error(
    settings: DynamicsSettings, *, seconds: float = 30.0, num_drones: int = 8, seed: int = 0
) -> HoverError:
    """Hover 5 m above the ground, starting at rest in moving air.

    Args:
        settings: Settings of drone and air.
        seconds: Duration.
        num_drones: Number of drones, each with its own gusts.
        seed: Seed of the first drone's gusts; the others have the following seeds.
    """
    quadrotor = Quadrotor(settings)
    place = torch.tensor([[0.0, 0.0, 5.0]], dtype=torch.float64).repeat(num_drones, 1)
    body = quadrotor.start(place, torch.arange(seed, seed + num_drones))
    states, _ = fly_command(quadrotor, body, Hover(body, seconds))
    distances = (torch.stack([state.position for state in states]) - place).norm(dim=-1)
    return HoverError(float(distances[len(distances) // 2 :].mean()), float(distances.max()))


WIND = 5.0
"""Wind speed of the hover test, m/s."""
_DIRECTIONS = 8
"""Number of wind directions."""


def bench_flight_paths(setup: Setup) -> dict[str, Any]:
    """Measure path following and hovering of the default drone.

    Returns:
        "path_error_m": mean distance from a square of 10 m at 2 m/s. "path_errors": length, speed,
        mean and largest distance, and seconds of every course. "hover_error_m": steady-state mean
        distance of a hovering drone from its position in wind of 5 m/s, for the worst direction;
        "hover_greatest_m": the largest distance.
    """
    chosen = {"square": courses()["square"]} if setup.quick else courses()
    followed = path_following(chosen)
    errors = [_wind_error(number) for number in range(1 if setup.quick else _DIRECTIONS)]
    return {
        "path_error_m": followed["square"].mean,
        "path_errors": {name: vars(following) for name, following in followed.items()},
        "hover_error_m": max(error.mean for error in errors),
        "hover_greatest_m": max(error.greatest for error in errors),
    }


def _wind_error(number: int) -> HoverError:
    angle = 2.0 * math.pi * number / _DIRECTIONS
    wind = (WIND * math.cos(angle), WIND * math.sin(angle), 0.0)
    return hover_error(DynamicsSettings(mode="simple_flight", wind=wind), num_drones=1)


def fly_command(
    quadrotor: Quadrotor,
    body: FlightState,
    command: Command,
    seconds: float = math.inf,
    obstacles: Obstacles | None = None,
) -> tuple[list[FlightState], Tensor]:
    """Run one command until all drones are complete; drones that are complete continue.

    It ends after `seconds`, or the command's own limit, at the latest.

    Returns:
        The state at the start and after each of T - 1 control periods, and the index of the first
        one at which each drone was complete, of shape (num_envs,), int64; T if it never was.
    """
    ticks = period_ticks(quadrotor.settings)
    states = [body]
    done = torch.full((len(body),), -1)
    most = int(min(seconds, command.limit) / (ticks * quadrotor.settings.tick))
    while len(states) <= most and bool((done < 0).any()):
        body = quadrotor.fly(body, command.goals(body), ticks, obstacles)
        done = torch.where((done < 0) & command.is_complete(body), len(states), done)
        states.append(body)
    return states, torch.where(done < 0, len(states), done)
