"""What the settings of every task have in common."""

import dataclasses
from typing import Annotated, Any, ClassVar, NamedTuple

from drone_rl.utils.schema import Real, Several
from drone_rl.utils.settings import Settings

Length = Annotated[float, Real(0.001, 10_000.0, unit="m")]
Bound = Annotated[float, Real(0.0, 10_000.0, unit="m")]
Color = Annotated[tuple[float, float, float], Several(Real(0.0, 1.0), 3, 3)]
FIRST = "collect_cubes"
"""The task of files that name none."""


class Things(NamedTuple):
    """Where a task's targets and obstacles stand, for what is put beside them. Metres."""

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


@dataclasses.dataclass(frozen=True, kw_only=True)
class BaseTaskSettings(Settings):
    """What the settings of a task are; each task has a class of its own."""

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
