"""Settings of tasks: their base class, cube collection and the field of pillars, by name."""

import math
import random
from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, NamedTuple, TypeVar

from drone_rl.config.parts import Named
from drone_rl.config.terms import Rewards
from drone_rl.config.values import Steps
from drone_rl.utils.schema import Real, Several, Whole
from drone_rl.utils.settings import Settings

Length = Annotated[float, Real(0.001, 10_000.0, unit="m")]
Bound = Annotated[float, Real(0.0, 10_000.0, unit="m")]
Color = Annotated[tuple[float, float, float], Several(Real(0.0, 1.0), 3, 3)]
DEFAULT_TASK = "collect_cubes"
"""Task of files that do not name one."""


class ObjectRegion(NamedTuple):
    """Region of targets and obstacles, which distractors are placed outside. Metres."""

    size: float
    """Edge of one, seen from above."""
    color: tuple[float, float, float]
    """Red, green, blue in [0, 1]."""
    bound: float
    """Largest |y|."""
    first: float
    """Least x."""
    last: float
    """Largest x."""
    altitude: float
    """Least z at which the drone starts."""
    room: float
    """Least distance from there to the surface of an object."""


TASKS: dict[str, type["BaseTaskSettings"]] = {}
"""Settings of each task by its name; `drone_rl.sim.tasks.register_task` adds further ones."""


class BaseTaskSettings(Named):
    """Settings of a task: scene, rewards and ends of episodes."""

    registry: ClassVar[dict[str, Any]] = TASKS
    default_name: ClassVar[str | None] = DEFAULT_TASK
    object_size: ClassVar[str | None] = None
    """Name of the setting that is the size of its objects; None if there is none."""

    @property
    def object_region(self) -> ObjectRegion | None:
        """Region, size and color of the task's objects; None if unknown."""
        return None

    def __reduce__(self) -> Any:
        """Pickle the values and the name, since classes of terms are made at run time."""
        return BaseTaskSettings.read, ({"name": self.name, **Settings.values(self)}, "task")

    def values(self) -> dict[str, Any]:
        """See `Settings.values`; a task other than `DEFAULT_TASK` has its name."""
        named = {} if self.name == DEFAULT_TASK else {"name": self.name}
        return {**named, **super().values()}


S = TypeVar("S", bound=type[BaseTaskSettings])


def add_task(settings: S) -> S:
    """Add the settings of a task to `TASKS`; a class decorator."""
    TASKS[settings.name] = settings
    return settings


@add_task
class TaskSettings(BaseTaskSettings):
    """The cubes, the drone's moves and the boundaries. Lengths in metres.

    World frame: x forward, y left, z up; the drone starts at x = y = 0. The defaults are the
    original study's, except the sizes of cube and drone, which it does not state. With these, a
    uniformly random policy collects about as many cubes as in the study (0.84).
    """

    name: ClassVar[str] = DEFAULT_TASK
    object_size: ClassVar[str | None] = "cube_size"
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
    step_limit: Steps = 300
    """Steps after which an episode is truncated."""
    reward: Rewards = {"reached": {"weight": 1.0}}  # pyright: ignore[reportAssignmentType] (read)
    """Its terms by name, with weights; `task.reward.NAME.weight=0.1` adds or changes one."""
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
    def must_climb(self) -> bool:
        """Whether a drone that keeps its altitude passes some cubes without touching them."""
        return self.vertical_bound > self.touch_distance

    @property
    def height_bound(self) -> float:
        """|z - altitude| beyond which the drone is out of bounds, in metres."""
        return self.vertical_bound + self.touch_distance if self.must_climb else math.inf

    @property
    def object_region(self) -> ObjectRegion:
        """Where the cubes are; see `BaseTaskSettings`."""
        first, last = self.first_distance, self.last_distance
        color, bound = self.cube_color, self.lateral_bound
        room = first - 0.5 * self.cube_size
        return ObjectRegion(self.cube_size, color, bound, first, last, self.altitude, room)

    def check(self) -> None:
        """Reject tasks that can't be simulated or solved."""
        lowest = self.vertical_bound + 0.5 * self.cube_size
        if self.altitude < lowest:
            self.refuse("altitude", f"sinks cubes into the floor; give at least {lowest}")
        if self.must_climb and self.altitude <= self.height_bound:
            self.refuse("altitude", f"is too low to climb; give more than {self.height_bound}")
        reach = f"{self.touch_distance} ((cube_size + drone_size) / 2)"
        if self.step_length > self.touch_distance:
            self.refuse("step_length", f"makes the oracle overshoot cubes; give at most {reach}")
        if self.first_distance <= self.touch_distance:
            self.refuse("first_distance", f"starts inside the first cube; give more than {reach}")
        needed = math.ceil((self.last_distance - self.touch_distance) / self.step_length)
        if self.step_limit < needed:
            self.refuse("step_limit", f"ends before the last cube; give at least {needed}")


_TRIED, _LEAST_OPEN = 400, 20
"""Rows that are sampled to check that a field can be crossed, and how many must be open."""


@add_task
class PillarsSettings(BaseTaskSettings):
    """Rows of pillars, the line beyond them, and the drone's moves. Lengths in metres.

    World frame: x forward, y left, z up; the drone starts at x = y = 0.
    """

    name: ClassVar[str] = "pillars"
    object_size: ClassVar[str | None] = "width"
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
    """Pillars are placed uniformly with |y| at most this; beyond, the drone is out of bounds."""
    height: Length = 6.0
    """Height of a pillar."""
    pillar_color: Color = (0.25, 0.16, 0.12)
    """Red, green, blue in [0, 1]."""
    finish_margin: Length = 4.0
    """How far behind the last row the line is that the drone must cross."""
    drone_size: Length = 0.8
    """Edge of the box around the drone that must touch no pillar."""
    altitude: Length = 2.5
    """z at which the drone starts and, in computer-vision mode, stays."""
    step_length: Length = 1.0
    """Length of one move."""
    step_limit: Steps = 120
    """Steps after which an episode is truncated."""
    reward: Rewards = {"progress": {"weight": 1.0}, "contact": {"weight": -0.5}}  # pyright: ignore[reportAssignmentType]
    """As in `collect_cubes`; reaching the line is worth the weight of `progress`."""

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
    def object_region(self) -> ObjectRegion:
        """Where the pillars are; see `BaseTaskSettings`."""
        first, last = self.first_distance, self.last_distance
        color, bound = self.pillar_color, self.spread
        room = first - 0.5 * self.width
        return ObjectRegion(self.width, color, bound, first, last, self.altitude, room)

    def check(self) -> None:
        """Reject fields that can't be simulated or crossed."""
        needed = 2.0 * (self.touch_distance + self.step_length)
        sidestep = "leaves no room to move aside before a row"
        for name, least, problem in (
            ("spacing", needed, sidestep),
            ("first_distance", self.touch_distance + self.step_length, sidestep),
            ("finish_margin", self.touch_distance, "puts the line into the last row"),
        ):
            if getattr(self, name) <= least:
                self.refuse(name, f"{problem}; give more than {least}")
        if self.height < self.altitude:
            self.refuse("height", f"is below the drone; give at least {self.altitude} (altitude)")
        steps = math.ceil(self.finish / self.step_length)
        if self.step_limit < steps:
            self.refuse("step_limit", f"ends before the line; give at least {steps}")
        if sum(self._is_open(row) for row in self._rows()) < _LEAST_OPEN:
            self.refuse(
                "density",
                f"makes fields too dense to cross: fewer than {_LEAST_OPEN} of {_TRIED} rows have "
                "a gap; give a lower density, a smaller width or a larger spread",
            )

    def _rows(self) -> Iterator[list[float]]:
        """Sample rows: the y of their pillars."""
        source = random.Random(0)
        for _ in range(_TRIED):
            yield [source.uniform(-self.spread, self.spread) for _ in range(self.row_size)]

    def _is_open(self, row: list[float]) -> bool:
        """Whether a row leaves a lane, see `drone_rl.sim.tasks.pillars_lanes.Lanes.is_open`."""
        most = int(self.spread / self.step_length + 1e-9)
        lanes = (number * self.step_length for number in range(-most, most + 1))
        return any(all(abs(y - lane) > self.touch_distance for y in row) for lane in lanes)
