"""Some settings that replace those of something that exists already."""

import dataclasses
from collections.abc import Mapping
from typing import Annotated, Any

from drone_rl.config import TASKS, DynamicsSettings
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import as_mapping
from drone_rl.utils.settings import Settings, below, check_names, kinds_of, types_of


@dataclasses.dataclass(frozen=True)
class Changes:
    """The kind of value that gives some settings of a class; none keeps what there is."""

    of: type[Settings]

    def read(self, value: Any, where: str) -> dict[str, Any]:
        """See `drone_rl.utils.schema.Kind`."""
        given = as_mapping(value, where)
        with below(where):
            check_names(self.of, given)
            kinds = kinds_of(self.of)
            return {n: kinds[n].read(v, n) for n, v in given.items() if v is not None}


@dataclasses.dataclass(frozen=True)
class ChangesOfTask:
    """The kind of value that gives some settings of any task; none keeps what there is.

    Their values are read when it is known which task it is.
    """

    @property
    def types(self) -> dict[str, Any]:
        """The plain type of every setting that some task has."""
        return {
            name: hint for settings in TASKS.values() for name, hint in types_of(settings).items()
        }

    def read(self, value: Any, where: str) -> dict[str, Any]:
        """See `drone_rl.utils.schema.Kind`."""
        given = as_mapping(value, where)
        for name in given:
            if name not in self.types:
                known = ", ".join(self.types)
                raise InputError(f"{where}.{name} is unknown; there are: {known}")
        return {name: v for name, v in given.items() if v is not None}


TaskChanges = Annotated[Mapping[str, Any], ChangesOfTask()]
DynamicsChanges = Annotated[Mapping[str, Any], Changes(DynamicsSettings)]


def no_changes() -> Any:
    """A field without any."""
    return dataclasses.field(default_factory=dict)
