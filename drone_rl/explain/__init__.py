"""What a policy sees, and whether to trust it: measures checked against the simulator's truth.

`drone_rl.explain` is this package and a function of the API, too: called, it is
`drone_rl.api.explaining.explain`.
"""

import importlib
import sys
import types
from typing import Any


class _Explain(types.ModuleType):
    """A package that can be called."""

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """See `drone_rl.api.explaining.explain`."""
        return importlib.import_module("drone_rl.api.explaining").explain(*args, **kwargs)


sys.modules[__name__].__class__ = _Explain
