"""Settings of a task of terms: objects, starts, bounds, rewards, ends and success."""

import math
from collections.abc import Mapping
from typing import Annotated, Any, Self

from pydantic import BeforeValidator

from drone_rl.config.task import BaseTaskSettings, Color, ObjectRegion
from drone_rl.config.terms import Ends, Events, Rewards, Success
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Listed, OneOf, Real, Several, Span, Text, Whole
from drone_rl.utils.settings import Settings

Coordinate = Annotated[Any, Span(Real(-1000.0, 1000.0, unit="m"))]
Size = Real(0.01, 1000.0, unit="m")
SiteName = Annotated[str, Text(100)]
_ALTITUDE = 2.5
"""Height of starts without sites, metres."""
ANYWHERE = "anywhere"
"""Name of the sites of a start in free space."""
_AROUND: dict[str, Any] = {"x": (5.0, 20.0), "y": (-6.0, 6.0)}
"""Where objects are by default."""
ROLES = ("goal", "obstacle", "decoration")
SHAPES = ("ball", "cylinder", "box")


def _dotted(given: Any) -> Any:
    """Return a mapping whose names have dots instead of mappings inside of it."""
    if not isinstance(given, Mapping):
        return given
    flat: dict[Any, Any] = {}
    for name, value in given.items():
        inner = _dotted(value)
        is_nested = isinstance(inner, Mapping)
        flat |= (
            {f"{name}.{key}": item for key, item in inner.items()} if is_nested else {name: value}
        )
    return flat


class ObjectSettings(Settings):
    """Objects of one kind. Lengths in metres, world frame: x forward, y left, z up."""

    shape: Annotated[str, OneOf(SHAPES)] = "box"
    """ball, cylinder (upright) or box."""
    body: Annotated[str, Text(100)] = ""
    """Name of the scene file's body that it is, with all that is fixed to it, instead of a shape
    with a size and a color; x, y and z are of the middle of the box around it."""
    role: Annotated[str, OneOf(ROLES)] = "obstacle"
    """goal, which vanishes when the drone touches it; obstacle, which is solid; decoration."""
    count: Annotated[int, Whole(1, 200, "objects")] = 1
    """How many there are."""
    size: Annotated[tuple[float, float, float], Several(Size, 3, 3)] = (1.0, 1.0, 1.0)
    """Edges along x, y and z; of a ball the diameter thrice, of a cylinder the diameter twice."""
    heading: Annotated[float, Real(-360.0, 360.0, unit="deg")] = 0.0
    """By which a box or a body is turned to the left, so that its own x points there."""
    color: Color = (0.25, 0.16, 0.12)
    """Red, green, blue in [0, 1]."""
    x: Coordinate | None = None
    """Of the centre: a number, or the range in which each episode places it. None for 5 to 20, or
    for where the file has its body, as in y and z."""
    y: Coordinate | None = None
    """See x; None for -6 to 6."""
    z: Coordinate | None = None
    """See x; None stands it on the ground."""
    site: SiteName = ""
    """Where it is instead of x, y and z: at one of the sites of the scene file whose names begin
    with this, which each episode draws; anywhere in the site if that is a box."""
    apart: Annotated[float, Real(0.0, 1000.0, unit="m")] = 0.0
    """Least distance between its surface and those of the objects placed before it."""
    event: Events = {}
    """What moves it from there in each step, by name; the velocities of several add up."""

    @property
    def half_size(self) -> tuple[float, float, float]:
        """Half of the edges."""
        x, y, z = self.size
        return 0.5 * x, 0.5 * y, 0.5 * z

    @property
    def reach(self) -> tuple[float, float, float]:
        """Half of the edges of the box around it that is parallel to the world's axes."""
        x, y, z = self.half_size
        angle = math.radians(self.heading)
        cos, sin = abs(math.cos(angle)), abs(math.sin(angle))
        return cos * x + sin * y, sin * x + cos * y, z

    def range_of(self, axis: str) -> tuple[float, float]:
        """Return the lowest and highest value of a coordinate of the centre."""
        value = getattr(self, axis)
        value = {**_AROUND, "z": self.half_size[2]}[axis] if value is None else value
        return value if isinstance(value, tuple) else (value, value)

    def check(self) -> None:
        """Reject shapes that their sizes contradict."""
        x, y, z = self.size
        if (x != y and self.shape != "box") or (x != z and self.shape == "ball"):
            equal = "three equal sizes" if self.shape == "ball" else "equal sizes along x and y"
            raise InputError(f"size={list(self.size)} is no {self.shape}; give {equal}, or a box")
        if self.heading and self.shape != "box" and not self.body:
            raise InputError(f"heading={self.heading:g} turns a {self.shape}; turn only boxes")


class StartSettings(Settings):
    """Where the drone starts. Metres and degrees, world frame."""

    x: Coordinate = 0.0
    """A number, or the range in which each episode draws it."""
    y: Coordinate = 0.0
    """See x."""
    z: Coordinate | None = None
    """See x; None for 2.5, with sites for the height of the start's or else of the goal's."""
    heading: Annotated[Any, Span(Real(-360.0, 360.0, unit="deg"))] = 0.0
    """To the left of the x axis, or of that of the site."""
    apart: Annotated[float, Real(0.0, 1000.0, unit="m")] = 1.0
    """Least distance between the drone's surface and those of obstacles and goals."""
    site: SiteName = ""
    """Where it starts instead of x and y: at one of the sites of the scene file whose names begin
    with this, anywhere in the site if that is a box; `anywhere` for all free space."""

    def range_of(self, axis: str) -> tuple[float, float]:
        """Return the lowest and highest value of a coordinate or of the heading."""
        value = getattr(self, axis)
        value = _ALTITUDE if value is None else value
        return value if isinstance(value, tuple) else (value, value)


class TermTaskSettings(BaseTaskSettings):
    """A task of terms; `drone_rl.define_task` gives one a name. Lengths in metres."""

    scene: Annotated[tuple[str, ...], Listed("scene file", 16)] | None = None
    """File of the scene, MJCF or a mesh, or several, one of which each episode draws. None for an
    empty field."""
    scene_up: Annotated[str, OneOf(("z", "y"))] = "z"
    """Axis of a mesh that points up."""
    scene_scale: Annotated[float, Real(1e-6, 1e6)] = 1.0
    """Metres of one unit of a mesh."""
    objects: dict[str, ObjectSettings] = {}
    """Objects by name; those placed later keep away from earlier ones."""
    start: StartSettings = StartSettings()
    """Where the drone starts."""
    reward: Rewards = {}
    """Its terms by name, with weights; `task.reward.NAME.weight=0.1` adds or changes one."""
    end: Ends = {}
    """Reasons to end an episode, by name; earlier ones precede later ones and success."""
    success: Success = {}
    """The one meaning of success, by name."""
    curriculum: Annotated[dict[str, Coordinate], BeforeValidator(_dotted)] = {}
    """Ranges in which a training begins, such as objects.ball.x: [5, 6]. As success rises, each
    widens to the range of its setting, which everything but training uses from the start."""
    margin: Annotated[float, Real(0.0, 1000.0, unit="m")] = 10.0
    """How far outside the region of starts and objects the bounds are."""
    drone_size: Annotated[float, Real(0.01, 10.0, unit="m")] = 0.8
    """Diameter of the ball that touches objects."""
    step_length: Annotated[float, Real(0.001, 100.0, unit="m")] = 1.0
    """Length of one move."""
    step_limit: Annotated[int, Whole(1, 100_000, "steps")] = 100
    """Steps after which an episode is truncated."""

    def check(self) -> None:
        """Reject tasks without a goal or meaning of success, or whose rewards are all zero."""
        if not any(of.role == "goal" for of in self.objects.values()):
            raise InputError("objects have no goal; give one of them role: goal")
        if len(self.success) != 1:
            raise InputError(f"success has {len(self.success)} terms; give one, such as all_goals")
        weights: dict[str, Any] = {name: term for name, term in self.reward.items()}
        if not any(term.weight for term in weights.values()):
            raise InputError("reward has no weight other than 0; give one, such as progress: 1.0")
        self.at_level(0.0)

    def at_level(self, level: float) -> Self:
        """Return the settings at a level of the curriculum: 0 where it begins, 1 where it ends.

        Raises:
            InputError: The curriculum names no range, or begins outside of one.
        """
        if not self.curriculum:
            return self
        parts = {"start": self.start, **{f"objects.{n}": of for n, of in self.objects.items()}}
        changed: dict[str, Any] = dict(parts)
        for key, given in self.curriculum.items():
            name, _, axis = key.rpartition(".")
            part = parts.get(name)
            if part is None or axis not in ("x", "y", "z", "heading") or not hasattr(part, axis):
                known = ", ".join(f"{known}.x" for known in parts)
                raise InputError(f"curriculum.{key} names no range; give one such as {known}")
            first, last = given if isinstance(given, tuple) else (given, given)
            end = part.range_of(axis)
            if not end[0] <= first <= last <= end[1]:
                raise InputError(
                    f"curriculum.{key}={[first, last]} is not within {list(end)}, where it ends; "
                    "give a range inside of it"
                )
            at = tuple(a + level * (b - a) for a, b in zip((first, last), end, strict=True))
            changed[name] = changed[name].replace(**{axis: at})
        objects = {name: changed[f"objects.{name}"] for name in self.objects}
        return self.replace(start=changed["start"], objects=objects, curriculum={})

    @property
    def has_sites(self) -> bool:
        """Whether sites of scene files say where the start or objects are."""
        return any(of.site for of in (self.start, *self.objects.values()))

    @property
    def low(self) -> tuple[float, ...]:
        """Least coordinates within the bounds."""
        return tuple(low - self.margin for low, _ in map(self._reach, "xyz"))

    @property
    def high(self) -> tuple[float, ...]:
        """Largest coordinates within the bounds."""
        return tuple(high + self.margin for _, high in map(self._reach, "xyz"))

    def _reach(self, axis: str) -> tuple[float, float]:
        ranges = [of.range_of(axis) for of in (self.start, *self.objects.values())]
        return min(low for low, _ in ranges), max(high for _, high in ranges)

    @property
    def object_region(self) -> ObjectRegion | None:
        """Where the objects are; see `BaseTaskSettings`. None if a scene file says so."""
        if self.has_sites or any(of.body for of in self.objects.values()):
            return None
        every = self.objects.values()
        size = 2 * max(max(of.reach[:2]) for of in every)
        color = next(of.color for of in every if of.role == "goal")
        bound = max(abs(y) for of in (self.start, *every) for y in of.range_of("y"))
        first = min(of.range_of("x")[0] for of in every)
        last = max(of.range_of("x")[1] for of in every)
        room = self.start.apart + 0.5 * self.drone_size
        return ObjectRegion(size, color, bound, first, last, self.start.range_of("z")[0], room)
