"""Settings of cube collection.

The defaults are the original study's; the sizes of the cube and the drone, which it leaves out, are
chosen so that a uniformly random policy collects about as much as it did there (0.84 cubes).
"""

import math
from typing import Annotated, ClassVar

from drone_rl.config.task import FIRST, BaseTaskSettings, Bound, Color, Length, Things, add_task
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Whole


@add_task
class TaskSettings(BaseTaskSettings):
    """The cubes, the drone's moves and the boundaries. Lengths in metres, world frame.

    The world frame has x forward, y left and z up; the drone starts at x = y = 0.
    """

    name: ClassVar[str] = FIRST
    num_cubes: Annotated[int, Whole(1, 100, "cubes")] = 3
    """Cubes placed in every episode."""
    first_distance: Length = 15.0
    """x of the first cube."""
    spacing: Length = 9.0
    """Distance in x from one cube to the next."""
    lateral_bound: Bound = 6.0
    """Cubes are placed uniformly with |y| at most this."""
    vertical_bound: Bound = 0.0
    """Cubes are placed uniformly at most this far above or below the drone's altitude."""
    cube_size: Length = 2.5
    """Edge of a cube."""
    cube_color: Color = (0.75, 0.12, 0.08)
    """Red, green, blue in [0, 1]."""
    drone_size: Length = 0.8
    """Edge of the box around the drone that touches cubes."""
    altitude: Length = 2.5
    """z at which the drone starts and, in computer-vision mode, stays."""
    step_length: Length = 1.0
    """Length of one move."""
    step_limit: Annotated[int, Whole(1, 100_000, "steps")] = 300
    """Steps after which an episode is truncated."""
    front_margin: Length = 11.0
    """How far behind the last cube the front boundary stands."""
    side_margin: Length = 20.0
    """How far outside the cubes' range the left and right boundaries stand."""

    @property
    def touch_distance(self) -> float:
        """Centre distance along an axis, in metres, up to which drone and cube touch."""
        return 0.5 * (self.cube_size + self.drone_size)

    @property
    def last_distance(self) -> float:
        """X of the last cube, in metres."""
        return self.first_distance + (self.num_cubes - 1) * self.spacing

    @property
    def front_bound(self) -> float:
        """X beyond which the drone is out of bounds, in metres. Grows with the number of cubes."""
        return self.last_distance + self.front_margin

    @property
    def side_bound(self) -> float:
        """|y| beyond which the drone is out of bounds, in metres."""
        return self.lateral_bound + self.side_margin

    @property
    def things(self) -> Things:
        """The cubes."""
        return Things(
            self.cube_size,
            self.cube_color,
            self.lateral_bound,
            self.first_distance,
            self.last_distance,
            self.altitude,
        )

    def check(self) -> None:
        """Refuse tasks that can't be simulated or solved."""
        if self.vertical_bound > self.touch_distance:
            raise InputError(
                f"vertical_bound={self.vertical_bound} puts cubes where a drone that keeps "
                f"its altitude never touches them; give at most {self.touch_distance} "
                "(half of cube_size + drone_size)"
            )
        if self.altitude - self.vertical_bound - 0.5 * self.cube_size < 0:
            raise InputError(
                f"altitude={self.altitude} sinks cubes into the floor; give at least "
                f"{self.vertical_bound + 0.5 * self.cube_size} (vertical_bound + cube_size / 2)"
            )
        if self.step_length > self.touch_distance:
            raise InputError(
                f"step_length={self.step_length} jumps over cubes; give at most "
                f"{self.touch_distance} (half of cube_size + drone_size)"
            )
        if self.first_distance <= self.touch_distance:
            raise InputError(
                f"first_distance={self.first_distance} starts the drone inside the first "
                f"cube; give more than {self.touch_distance} (half of cube_size + drone_size)"
            )
        needed = math.ceil((self.last_distance - self.touch_distance) / self.step_length)
        if self.step_limit < needed:
            raise InputError(
                f"step_limit={self.step_limit} ends every episode before the last cube can be "
                f"reached; give at least {needed}"
            )
