"""What the settings of every task have in common, and the tasks by name."""

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
    """They stand with |y| at most this."""
    first: float
    """Their x, from this on."""
    last: float
    """And up to this."""
    altitude: float
    """z at which the drone starts."""


class BaseTaskSettings(Settings):
    """Base class of a task's settings."""

    name: ClassVar[str]
    """What files call the task."""

    @property
    def things(self) -> Things | None:
        """Where its things stand; none where that can't be said."""
        return None

    def values(self) -> dict[str, Any]:
        """See `Settings.values`; the task is named, but for the first that there was."""
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
    """Return the class of a task's settings.

    Args:
        name: Name of the task.
        where: Name of the setting, for messages.

    Raises:
        InputError: There is no such task.
    """
    if not isinstance(name, str) or name not in TASKS:
        raise InputError(f"{where}={shown(name)} is unknown; there are: {', '.join(TASKS)}")
    return TASKS[name]


def named_settings(data: Any, where: str) -> tuple[type[BaseTaskSettings], Mapping[str, Any]]:
    """Return the class of a task's settings and the values without the name.

    Args:
        data: A mapping; without "name" it describes the first task.
        where: Name of the mapping, for messages.

    Raises:
        InputError: There is no such task.
    """
    given = dict(as_mapping(data, where))
    return settings_of(given.pop("name", FIRST), f"{where}.name"), given


def read_task(data: Any, where: str) -> BaseTaskSettings:
    """Read settings of a task from plain data that has every field and no other.

    Args:
        data: See `named_settings`.
        where: Name of the mapping, for messages.

    Raises:
        InputError: See `Settings.read`.
    """
    cls, given = named_settings(data, where)
    return cls.read(given, where)
