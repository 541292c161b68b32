"""Actions and warnings when other packages are imported."""

import contextlib
import functools
import importlib
import os
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from importlib.machinery import ModuleSpec, PathFinder
from types import FunctionType, MethodType, ModuleType
from typing import Any


def when_imported(name: str, do: Callable[[], None]) -> None:
    """Call a function right after a top-level package is imported, or now if it is already.

    The function must not import modules that import the package.
    """
    if sys.modules.get(name) is not None:  # None forbids the import
        do()
        return

    def execute_and_do(module: ModuleType, execute: Callable[[ModuleType], None]) -> None:
        execute(module)
        if hook in sys.meta_path:
            sys.meta_path.remove(hook)
            do()

    hook = _Hook(name, execute_and_do)
    sys.meta_path.insert(0, hook)


def import_quietly(name: str, category: str, words: str) -> None:
    """Hide a warning that a module of another package issues while it is imported.

    `name` is the module's dotted name, `category` the name of the warning's class, which may not
    be imported yet, and `words` a part of the warning.
    """

    def execute_quietly(module: ModuleType, execute: Callable[[ModuleType], None]) -> None:
        with warnings.catch_warnings():
            # a filter suffices for -W error, but glfw inserts its own before it
            warnings.filterwarnings("ignore", f".*{words}", DeprecationWarning)
            show = warnings.showwarning

            def show_others(message: Warning | str, kind: type, *rest: Any) -> None:
                if kind.__name__ != category or words not in str(message):
                    show(message, kind, *rest)

            warnings.showwarning = show_others
            execute(module)

    sys.meta_path.insert(0, _Hook(name, execute_quietly))


def import_with_fallback(name: str, variable: str, value: str) -> None:
    """Import a module of another package with an environment variable set if it fails without.

    `name` is the module's dotted name. The variable is restored after the import.
    """

    def execute_again(module: ModuleType, execute: Callable[[ModuleType], None]) -> None:
        given = os.environ.get(variable)
        try:
            execute(module)
        except Exception:
            if given is None:
                raise
            os.environ[variable] = value
            try:
                execute(module)
            finally:
                os.environ[variable] = given

    sys.meta_path.insert(0, _Hook(name, execute_again))


class _Hook:
    """A finder of one module that wraps the module's execution."""

    def __init__(
        self, name: str, execute: Callable[[ModuleType, Callable[[ModuleType], None]], None]
    ) -> None:
        self.name, self.execute = name, execute

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Find the module as Python does; no other module is found."""
        spec = PathFinder.find_spec(name, path, target) if name == self.name else None
        if spec is None or spec.loader is None:
            return None
        execute = spec.loader.exec_module

        def exec_module(module: ModuleType) -> None:
            self.execute(module, execute)

        spec.loader.exec_module = exec_module
        return spec


ENVIRONMENTS = {
    "drone_rl/CollectCubes-v0": "collect_cubes",
    "drone_rl/Pillars-v0": "pillars",
}
"""Task of each Gymnasium environment; `gymnasium.make` takes its settings as options."""


def register() -> None:
    """Register the environments with Gymnasium unless they are registered already."""
    import gymnasium  # an optional extra

    for name, task in ENVIRONMENTS.items():
        if name not in gymnasium.registry:
            gymnasium.register(
                name,
                entry_point="drone_rl:DroneWorld",
                vector_entry_point="drone_rl:DroneWorlds",
                kwargs={"task": task},
            )


@contextlib.contextmanager
def standard_error_closed() -> Iterator[None]:
    """Discard all output to standard error, also of compiled code."""
    sys.stderr.flush()
    kept = os.dup(2)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        yield
    finally:
        sys.stderr.flush()  # an unfinished line, too
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


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
