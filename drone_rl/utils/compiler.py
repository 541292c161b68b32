"""torch's compiler, left unloaded by commands, which compile nothing: it takes a second to import.

tensordict and torchrl only mark functions for it, and optimisers only ask it to leave them alone.
Both are noted here until somebody asks for anything else of `torch._dynamo`, as `torch.compile`
does; then it is loaded, and told.
"""

import functools
import importlib
import sys
import types
from collections.abc import Callable
from typing import Any

NAME = "torch._dynamo"


def leave_compiler_unloaded() -> None:
    """Stands in for `torch._dynamo` in this process; for programs, not for libraries."""
    sys.modules.setdefault(NAME, _Unloaded())


class _Unloaded(types.ModuleType):
    """Takes down what libraries say of their functions."""

    def __init__(self) -> None:
        super().__init__(NAME)
        self._allowed: list[Any] = []

    def allow_in_graph(self, function: Any) -> Any:
        """Notes a function, or several, and returns it."""
        self._allowed.append(function)
        return function

    def assume_constant_result(self, function: Any) -> Any:
        """Marks a function, as the compiler itself does."""
        function._dynamo_marked_constant = True
        return function

    def graph_break(self, *args: Any, **kwargs: Any) -> None:
        """Does nothing, as ever outside of what is compiled."""

    def disable(self, function: Any = None, recursive: bool = True, **options: Any) -> Any:
        """Returns the function as one that is not compiled, once there is anything that could."""
        if function is None:
            return functools.partial(self.disable, recursive=recursive, **options)
        if not isinstance(function, types.FunctionType | types.MethodType):
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
        """Loads the compiler for everything else."""
        if name.startswith("__") and name != "__path__":  # what inspection asks of every module
            raise AttributeError(name)
        return getattr(self._load(), name)

    def _load(self) -> types.ModuleType:
        if sys.modules.get(NAME) is self:
            del sys.modules[NAME]
            real = importlib.import_module(NAME)
            for function in self._allowed:
                real.allow_in_graph(function)
        return sys.modules[NAME]
