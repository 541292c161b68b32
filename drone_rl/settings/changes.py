"""Some settings that replace those of something that exists already."""

import dataclasses
from collections.abc import Mapping
from typing import Annotated, Any

from drone_rl.sim.settings import TaskSettings
from drone_rl.utils.schema import as_mapping
from drone_rl.utils.settings import Settings, below, check_names, kinds_of


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


TaskChanges = Annotated[Mapping[str, Any], Changes(TaskSettings)]


def no_changes() -> Any:
    """A field without any."""
    return dataclasses.field(default_factory=dict)
