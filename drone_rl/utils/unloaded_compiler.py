"""A stand-in for `torch._dynamo`, which programs that compile nothing need not import.

The import takes as long as that of torch itself. PyTorch's optimizers and tensordict import it to
mark functions that the compiler must leave alone, and neither package documents an option against
that: `TORCH_COMPILE_DISABLE` and `TORCHDYNAMO_DISABLE` act after the import. Only the program
`drone-rl` uses it. `tests/utils/test_unloaded_compiler.py` fails once it is no longer needed.
"""

import functools
import importlib
import sys
from collections.abc import Callable
from types import FunctionType, MethodType, ModuleType
from typing import Any

NAME = "torch._dynamo"


def leave_compiler_unloaded() -> None:
    """Delay the import of `torch._dynamo` in this process, which saves a program over a second."""
    sys.modules.setdefault(NAME, _Unloaded())


class _Unloaded(ModuleType):
    """Placeholder of the module, which is imported when it is needed."""

    def __init__(self) -> None:
        super().__init__(NAME)
        self._allowed: list[Any] = []

    def allow_in_graph(self, function: Any) -> Any:
        """Record a function, or several, and return it."""
        self._allowed.append(function)
        return function

    def assume_constant_result(self, function: Any) -> Any:
        """Mark a function as the compiler does."""
        function._dynamo_marked_constant = True
        return function

    def graph_break(self, *args: Any, **kwargs: Any) -> None:
        """Do nothing, as outside of compiled code."""

    def disable(self, function: Any = None, recursive: bool = True, **options: Any) -> Any:
        """Return a function that calls the compiler's version once the compiler is imported."""
        if function is None:
            return functools.partial(self.disable, recursive=recursive, **options)
        if not isinstance(function, FunctionType | MethodType):
            return self._load().disable(function, recursive, **options)

        @functools.cache
        def disabled() -> Callable[..., Any]:
            return sys.modules[NAME].disable(function, recursive, **options)

        @functools.wraps(function)
        def call(*args: Any, **kwargs: Any) -> Any:
            is_unloaded = sys.modules.get(NAME) is self
            return (function if is_unloaded else disabled())(*args, **kwargs)

        return call

    def __getattr__(self, name: str) -> Any:
        """Import the compiler for all other names."""
        if name.startswith("__") and name != "__path__":  # inspection reads them of every module
            raise AttributeError(name)
        return getattr(self._load(), name)

    def _load(self) -> ModuleType:
        if sys.modules.get(NAME) is self:
            del sys.modules[NAME]
            real = importlib.import_module(NAME)
            for function in self._allowed:
                real.allow_in_graph(function)
        return sys.modules[NAME]
