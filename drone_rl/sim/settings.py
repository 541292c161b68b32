"""What can be chosen about the cube collection task, checked before anything is built.

The defaults are the original study's; the sizes of the cube and the drone, which it leaves out, are
chosen so that a uniformly random policy collects about as much as it did there (0.84 cubes).
"""

import dataclasses
import math

from drone_rl.utils.errors import InputError


@dataclasses.dataclass(frozen=True, kw_only=True)
class TaskSettings:
    """The cubes, the drone's moves and the boundaries. Lengths in metres, world frame.

    The world frame has x forward, y left and z up; the drone starts at x = y = 0.

    Raises:
        InputError: A value is out of range, or the settings together can't be met.
    """

    num_cubes: int = 3
    """Cubes placed in every episode."""
    first_distance: float = 15.0
    """x of the first cube."""
    spacing: float = 9.0
    """Distance in x from one cube to the next."""
    lateral_bound: float = 6.0
    """Cubes are placed uniformly with |y| at most this."""
    vertical_bound: float = 0.0
    """Cubes are placed uniformly at most this far above or below the drone's altitude."""
    cube_size: float = 2.5
    """Edge of a cube."""
    cube_color: tuple[float, float, float] = (0.75, 0.12, 0.08)
    """Red, green, blue in [0, 1]."""
    drone_size: float = 0.8
    """Edge of the box around the drone that touches cubes."""
    altitude: float = 2.5
    """z at which the drone starts and, in computer-vision mode, stays."""
    step_length: float = 1.0
    """Length of one move."""
    step_limit: int = 300
    """Steps after which an episode is truncated."""
    front_margin: float = 11.0
    """How far behind the last cube the front boundary stands."""
    side_margin: float = 20.0
    """How far outside the cubes' range the left and right boundaries stand."""

    def __post_init__(self) -> None:
        """Refuses what could not be simulated or never be solved."""
        object.__setattr__(self, "cube_color", tuple(self.cube_color))
        self._check_ranges()
        self._check_reachable()

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

    def _check_ranges(self) -> None:
        positive = ("first_distance", "spacing", "cube_size", "drone_size", "altitude")
        for name in (*positive, "step_length", "front_margin", "side_margin"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise InputError(f"task.{name}={value} is not a length; give metres above 0")
        for name in ("lateral_bound", "vertical_bound"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0):
                raise InputError(f"task.{name}={value} is out of range; give metres, 0 or more")
        for name in ("num_cubes", "step_limit"):
            value = getattr(self, name)
            if not (isinstance(value, int) and value >= 1):
                raise InputError(f"task.{name}={value} is out of range; give a whole number from 1")
        if len(self.cube_color) != 3 or not all(0 <= c <= 1 for c in self.cube_color):
            raise InputError(
                f"task.cube_color={list(self.cube_color)} is not a colour; "
                "give red, green and blue, each from 0 to 1"
            )

    def _check_reachable(self) -> None:
        if self.vertical_bound > self.touch_distance:
            raise InputError(
                f"task.vertical_bound={self.vertical_bound} puts cubes where a drone that keeps "
                f"its altitude never touches them; give at most {self.touch_distance} "
                "(half of cube_size + drone_size)"
            )
        if self.altitude - self.vertical_bound - 0.5 * self.cube_size < 0:
            raise InputError(
                f"task.altitude={self.altitude} sinks cubes into the floor; give at least "
                f"{self.vertical_bound + 0.5 * self.cube_size} (vertical_bound + cube_size / 2)"
            )
        if self.step_length > self.touch_distance:
            raise InputError(
                f"task.step_length={self.step_length} jumps over cubes; give at most "
                f"{self.touch_distance} (half of cube_size + drone_size)"
            )
        if self.first_distance <= self.touch_distance:
            raise InputError(
                f"task.first_distance={self.first_distance} starts the drone inside the first "
                f"cube; give more than {self.touch_distance} (half of cube_size + drone_size)"
            )
        needed = math.ceil((self.last_distance - self.touch_distance) / self.step_length)
        if self.step_limit < needed:
            raise InputError(
                f"task.step_limit={self.step_limit} ends every episode before the last cube can be "
                f"reached; give at least {needed}"
            )


@dataclasses.dataclass(frozen=True, kw_only=True)
class CameraSettings:
    """The picture that the policy's camera takes.

    Raises:
        InputError: A value is out of range.
    """

    width: int = 64
    """Pixels across."""
    height: int = 25
    """Pixels down."""
    horizontal_fov: float = 135.0
    """Horizontal field of view in degrees."""

    def __post_init__(self) -> None:
        """Refuses sizes and angles that no camera has."""
        for name in ("width", "height"):
            value = getattr(self, name)
            if not (isinstance(value, int) and 1 <= value <= 4096):
                raise InputError(f"camera.{name}={value} is out of range; give 1 to 4096 pixels")
        if not 1.0 <= self.horizontal_fov <= 170.0:
            raise InputError(
                f"camera.horizontal_fov={self.horizontal_fov} is out of range; "
                "give 1 to 170 degrees"
            )

    @property
    def vertical_fov(self) -> float:
        """Vertical field of view in degrees, for square pixels."""
        half = math.tan(math.radians(self.horizontal_fov) / 2) * self.height / self.width
        return math.degrees(2 * math.atan(half))
