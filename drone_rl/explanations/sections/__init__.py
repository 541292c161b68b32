"""The sections of an explanation: each a function of the context, in a file of its own.

A module of this package has a function `section`. It returns its numbers, by the keys of
`explanation.json`, and its arrays, by those of `arrays.npz`. It writes nothing, reads no other
section's results, and may run at any time. A new section is one file: it is found here, and the
report lays out what it finds, with pictures if `report/sections` has a part for it.
"""

import importlib
import pkgutil
from collections.abc import Callable
from typing import Any

from numpy.typing import NDArray

from drone_rl.explanations.context import Context

Numbers = dict[str, Any]
Arrays = dict[str, NDArray]
Section = Callable[[Context], tuple[Numbers, Arrays]]


def find_sections() -> dict[str, Section]:
    """All of them, by the names of their modules."""
    names = [module.name for module in pkgutil.iter_modules(__path__)]
    return {name: importlib.import_module(f"{__name__}.{name}").section for name in names}
