"""What is to be done as soon as another package is imported, and not before: imports are slow."""

import sys
import warnings
from collections.abc import Callable, Sequence
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType
from typing import Any


def when_imported(name: str, do: Callable[[], None]) -> None:
    """Does something now if a package is imported already, else right after it is.

    Args:
        name: The package's, without dots.
        do: What to do; it must import nothing that imports that package.
    """
    if sys.modules.get(name) is not None:  # None forbids it
        do()
    else:
        sys.meta_path.insert(0, _Waiting(name, do))


def import_quietly(name: str, category: str, words: str) -> None:
    """Hides a warning that a module of another package gives while it is imported.

    Nothing is hidden after the import, nor of other modules, categories or messages.

    Args:
        name: The module's, dotted.
        category: Name of the warning's class, which may be defined in a package not yet imported.
        words: Which the warning contains.
    """
    sys.meta_path.insert(0, _Quiet(name, category, words))


class _Quiet:
    """A finder of one module, which it leaves as it is but for a warning."""

    def __init__(self, name: str, category: str, words: str) -> None:
        self.name, self.category, self.words = name, category, words

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Finds the module where Python would, and nothing else."""
        spec = PathFinder.find_spec(name, path, target) if name == self.name else None
        if spec is None or spec.loader is None:
            return None
        execute = spec.loader.exec_module

        def execute_quietly(module: ModuleType) -> None:
            with warnings.catch_warnings():
                # a filter does for -W error, but glfw puts its own before it, so not for all
                warnings.filterwarnings("ignore", f".*{self.words}", DeprecationWarning)
                show = warnings.showwarning

                def show_the_rest(message: Warning | str, kind: type, *rest: Any) -> None:
                    if kind.__name__ != self.category or self.words not in str(message):
                        show(message, kind, *rest)

                warnings.showwarning = show_the_rest
                execute(module)

        spec.loader.exec_module = execute_quietly
        return spec


class _Waiting:
    """A finder of one package, which it leaves as it is."""

    def __init__(self, name: str, do: Callable[[], None]) -> None:
        self.name, self.do = name, do

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Finds the package where Python would, and nothing else."""
        spec = PathFinder.find_spec(name, path, target) if name == self.name else None
        if spec is None or spec.loader is None:
            return None
        execute = spec.loader.exec_module

        def execute_and_do(module: ModuleType) -> None:
            execute(module)
            if self in sys.meta_path:
                sys.meta_path.remove(self)
                self.do()

        spec.loader.exec_module = execute_and_do
        return spec
