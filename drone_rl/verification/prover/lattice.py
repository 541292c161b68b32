"""The places that a drone can be at, and what the rules of cube collection do there.

In computer-vision mode a drone moves a step at a time, so it is always a whole number of steps from
where it started: i ahead and j to the left.
"""

import dataclasses
import functools
import math
from collections.abc import Iterator

import numpy as np

from drone_rl.config import TaskSettings
from drone_rl.sim.tasks.collect_cubes import EndReason
from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.boxes import Boxes, cut

AHEAD, LEFT, RIGHT = range(3)
"""The actions."""


@dataclasses.dataclass(frozen=True)
class Place:
    """Where a drone is, what it has, and how it came there."""

    ahead: int
    """Steps."""
    left: int
    """Steps."""
    collected: int = 0
    """Bit k is set for cube k."""
    steps: int = 0
    """Taken so far."""
    came: int = AHEAD
    """The last action, if it was sideways and collected nothing; else `AHEAD`."""
    is_fork: bool = False
    """Whether another way could have been taken instead, as far as is known."""

    @functools.cached_property
    def turn(self) -> tuple:
        """Sorts places so that none comes before one that leads to it."""
        order = (0, self.left, -self.left)[self.came]
        return (self.ahead, self.collected.bit_count(), self.came, order, self.steps)


@dataclasses.dataclass(frozen=True, order=True)
class Ending:
    """How an episode ends."""

    reason: EndReason
    collected: int
    """Bit k is set for cube k."""
    loops: bool = False
    """Whether the drone goes to and fro until the step limit."""


class Lattice:
    """A task's rules on the lattice."""

    def __init__(self, task: TaskSettings) -> None:
        """Notes where everything is.

        Raises:
            InputError: Rounding makes places depend on the way there.
        """
        self.task = task
        step, count = task.step_length, task.step_limit + 1
        multiples = np.arange(-count, count + 1) * step
        if not np.array_equal(multiples[1:], multiples[:-1] + step):
            raise InputError(
                f"task.step_length={step} can't be added up without rounding, so that places "
                "depend on the way there; give a multiple of a power of two, such as 0.5 or 1.25"
            )
        self.cubes = task.first_distance + task.spacing * np.arange(task.num_cubes)
        """x of each cube, metres."""
        self.everything = (1 << task.num_cubes) - 1

    @property
    def last(self) -> int:
        """Steps ahead after which every episode has ended."""
        return int(self.task.front_bound / self.task.step_length) + 1

    def x(self, place: Place) -> float:
        """Metres from the start."""
        return place.ahead * self.task.step_length

    def y(self, place: Place) -> float:
        """Metres to the left of the start."""
        return place.left * self.task.step_length

    def standing(self, place: Place) -> list[int]:
        """Cubes that are neither collected nor left behind, the nearest first."""
        x = self.x(place)
        cubes = range(len(self.cubes))
        return [k for k in cubes if not place.collected >> k & 1 and x <= self.cubes[k]]

    def move(self, place: Place, action: int, boxes: Boxes) -> Iterator[tuple[Place, Boxes]]:
        """Where an action leads.

        Args:
            place: From where.
            action: Which.
            boxes: The cubes' places, metres.

        Yields:
            The next place, for each set of cubes that are then collected, and their places.
        """
        sideways = {AHEAD: 0, LEFT: 1, RIGHT: -1}[action]
        moved = dataclasses.replace(
            place,
            ahead=place.ahead + (action == AHEAD),
            left=place.left + sideways,
            steps=place.steps + 1,
            came=action,
        )
        for collected, part in self._touched(moved, self.standing(place), boxes):
            is_new = collected != place.collected
            came = AHEAD if is_new else action
            yield dataclasses.replace(moved, collected=collected, came=came), part

    def ending(self, place: Place) -> Ending | None:
        """How the episode has ended there, in the order of Algorithm 3; None if it goes on."""
        reason = None
        if place.steps >= self.task.step_limit:
            reason = EndReason.STEP_LIMIT
        if abs(self.y(place)) > self.task.side_bound:
            reason = EndReason.SIDE_BOUNDARY
        if self.x(place) > self.task.front_bound:
            reason = EndReason.FRONT_BOUNDARY
        if place.collected == self.everything:
            reason = EndReason.ALL_CUBES
        return None if reason is None else Ending(reason, place.collected)

    def _touched(self, place: Place, stood: list[int], boxes: Boxes) -> Iterator[tuple[int, Boxes]]:
        """Boxes by the cubes that the drone has at a place, of those that stood before."""
        parts = [(place.collected, boxes)]
        reach, y = self.task.touch_distance, self.y(place)
        first, beyond = _least(y, reach), math.nextafter(-_least(-y, reach), math.inf)
        for cube in stood:
            if abs(self.x(place) - self.cubes[cube]) > reach:
                continue
            for _ in range(len(parts)):
                collected, part = parts.pop(0)
                right, rest = cut(part, cube, first)
                touched, left = cut(rest, cube, beyond)
                with_it = collected | 1 << cube
                parts += [(collected, right), (with_it, touched), (collected, left)]
        yield from ((collected, part) for collected, part in parts if len(part))


def _least(y: float, reach: float) -> float:
    """The least number at a distance of at most `reach` from y, as floats are subtracted."""
    least = y - reach
    while abs(y - least) <= reach:
        least = math.nextafter(least, -math.inf)
    while abs(y - least) > reach:
        least = math.nextafter(least, math.inf)
    return least
