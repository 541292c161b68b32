"""Base class of tasks' settings, and the tasks by name."""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, NamedTuple, TypeVar

from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Real, Several, as_mapping, shown
from drone_rl.utils.settings import Settings

Length = Annotated[float, Real(0.001, 10_000.0, unit="m")]
Bound = Annotated[float, Real(0.0, 10_000.0, unit="m")]
Color = Annotated[tuple[float, float, float], Several(Real(0.0, 1.0), 3, 3)]
FIRST = "collect_cubes"
"""The task of files that name none."""


class Things(NamedTuple):
    """Where targets and obstacles are, so that distractors keep their distance. Metres."""

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
    """z at which the drone starts."""


class BaseTaskSettings(Settings):
    """Base class of a task's settings."""

    name: ClassVar[str]
    """Name of the task in files."""

    @property
    def things(self) -> Things | None:
        """Positions of targets and obstacles; None if unknown."""
        return None

    def values(self) -> dict[str, Any]:
        """See `Settings.values`; a task other than `FIRST` has its name."""
        named = {} if self.name == FIRST else {"name": self.name}
        return {**named, **super().values()}


S = TypeVar("S", bound=type[BaseTaskSettings])

TASKS: dict[str, type[BaseTaskSettings]] = {}
"""Settings of each task by its name; `drone_rl.sim.tasks.register_task` adds further ones."""


def add_task(settings: S) -> S:
    """Add the settings of a task to `TASKS`; a class decorator."""
    TASKS[settings.name] = settings
    return settings


def settings_of(name: object, where: str = "task.name") -> type[BaseTaskSettings]:
    """Return the class of a task's settings; `where` is the setting's name for messages.

    Raises:
        InputError: There is no such task.
    """
    if not isinstance(name, str) or name not in TASKS:
        raise InputError(f"{where}={shown(name)} is unknown; there are: {', '.join(TASKS)}")
    return TASKS[name]


def named_settings(data: Any, where: str) -> tuple[type[BaseTaskSettings], Mapping[str, Any]]:
    """Return the class of a task's settings and the values without the name.

    A mapping without "name" describes the first task. See `settings_of` for errors.
    """
    given = dict(as_mapping(data, where))
    return settings_of(given.pop("name", FIRST), f"{where}.name"), given


def read_task(data: Any, where: str) -> BaseTaskSettings:
    """Read settings of a task from plain data; see `named_settings` and `Settings.read`."""
    cls, given = named_settings(data, where)
    return cls.read(given, where)
