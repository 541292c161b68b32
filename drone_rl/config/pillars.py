"""Settings of the field of pillars."""

import math
import random
from collections.abc import Iterator
from typing import Annotated, ClassVar

from drone_rl.config.task import BaseTaskSettings, Color, Length, Things, add_task
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Real, Whole

_TRIED, _LEAST_OPEN = 400, 20
"""Rows that are sampled to check that a field can be crossed, and how many must be open."""


@add_task
class PillarsSettings(BaseTaskSettings):
    """Rows of pillars, the line beyond them, and the drone's moves. Metres, world frame.

    The world frame has x forward, y left and z up; the drone starts at x = y = 0.
    """

    name: ClassVar[str] = "pillars"
    num_rows: Annotated[int, Whole(1, 100, "rows")] = 4
    """Rows of pillars, one behind the other."""
    first_distance: Length = 9.0
    """x of the first row."""
    spacing: Length = 7.0
    """Distance in x from one row to the next."""
    density: Annotated[float, Real(0.001, 10.0, unit="per m")] = 0.25
    """Pillars for each metre across a row."""
    width: Length = 1.0
    """Edge of a pillar's square cross-section."""
    spread: Length = 8.0
    """Pillars stand uniformly with |y| at most this; who leaves that range is out of bounds."""
    height: Length = 6.0
    """Height of a pillar."""
    pillar_color: Color = (0.25, 0.16, 0.12)
    """Red, green, blue in [0, 1]."""
    finish_margin: Length = 4.0
    """How far behind the last row the line is that the drone must cross."""
    collision_penalty: Annotated[float, Real(0.0, 1000.0)] = 0.5
    """Penalty of a collision; reaching the line is worth 1."""
    drone_size: Length = 0.8
    """Edge of the box around the drone that must touch no pillar."""
    altitude: Length = 2.5
    """z at which the drone starts and, in computer-vision mode, stays."""
    step_length: Length = 1.0
    """Length of one move."""
    step_limit: Annotated[int, Whole(1, 100_000, "steps")] = 120
    """Steps after which an episode is truncated."""

    @property
    def row_size(self) -> int:
        """Pillars of a row."""
        return max(1, round(2.0 * self.spread * self.density))

    @property
    def num_pillars(self) -> int:
        """Pillars of the whole field."""
        return self.num_rows * self.row_size

    @property
    def touch_distance(self) -> float:
        """Centre distance along both axes, in metres, up to which drone and pillar touch."""
        return 0.5 * (self.width + self.drone_size)

    @property
    def last_distance(self) -> float:
        """X of the last row, in metres."""
        return self.first_distance + (self.num_rows - 1) * self.spacing

    @property
    def finish(self) -> float:
        """X of the line, in metres."""
        return self.last_distance + self.finish_margin

    @property
    def things(self) -> Things:
        """The pillars."""
        return Things(
            self.width,
            self.pillar_color,
            self.spread,
            self.first_distance,
            self.last_distance,
            self.altitude,
        )

    def check(self) -> None:
        """Refuse fields that can't be simulated or crossed."""
        needed = 2.0 * (self.touch_distance + self.step_length)
        for name, least in (
            ("spacing", needed),
            ("first_distance", self.touch_distance + self.step_length),
            ("finish_margin", self.touch_distance),
        ):
            if getattr(self, name) <= least:
                raise InputError(
                    f"{name}={getattr(self, name)} leaves no room to turn before or behind a row; "
                    f"give more than {least}"
                )
        if self.height < self.altitude:
            raise InputError(
                f"height={self.height} puts pillars below the drone; give at least {self.altitude} "
                "(altitude)"
            )
        steps = math.ceil(self.finish / self.step_length)
        if self.step_limit < steps:
            raise InputError(
                f"step_limit={self.step_limit} ends every episode before the line can be reached; "
                f"give at least {steps}"
            )
        if sum(self._is_open(row) for row in self._rows()) < _LEAST_OPEN:
            raise InputError(
                f"density={self.density} makes fields too dense to cross: of {_TRIED} rows, next "
                "to none leave a way through; give a lower density, a smaller width or a larger "
                "spread"
            )

    def _rows(self) -> Iterator[list[float]]:
        """Sample rows: the y of their pillars."""
        source = random.Random(0)
        for _ in range(_TRIED):
            yield [source.uniform(-self.spread, self.spread) for _ in range(self.row_size)]

    def _is_open(self, row: list[float]) -> bool:
        """Whether a row leaves a lane, see `drone_rl.sim.tasks.pillars.field`."""
        most = int(self.spread / self.step_length + 1e-9)
        lanes = (number * self.step_length for number in range(-most, most + 1))
        return any(all(abs(y - lane) > self.touch_distance for y in row) for lane in lanes)
