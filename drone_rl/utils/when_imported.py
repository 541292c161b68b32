"""What is to be done as soon as another package is imported, and not before: imports are slow."""

import sys
from collections.abc import Callable, Sequence
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType


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
