"""Actions when other packages are imported, and filters of what those packages print."""

import contextlib
import os
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
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


ENVIRONMENTS = {
    "drone_rl/CollectCubes-v0": "collect_cubes",
    "drone_rl/Pillars-v0": "pillars",
}
"""By name, the class of the task's settings, which `gymnasium.make` takes as options."""


def register() -> None:
    """Makes them known to Gymnasium; those that are known already stay as they are."""
    import gymnasium  # slow to import, and not everybody has it

    for name, task in ENVIRONMENTS.items():
        if name not in gymnasium.registry:
            gymnasium.register(
                name,
                entry_point="drone_rl:DroneWorld",
                vector_entry_point="drone_rl:DroneWorlds",
                kwargs={"task": task},
            )


NOISE = ("DISPLAY", "GLFW", "WeightUpdaterBase")
"""Words in warnings of dm_control, which looks for a screen, and of TorchRL, of its own classes."""


def ignore_noise() -> None:
    """Keeps warnings and log lines back that no user can do anything about.

    Filters would not do: dm_control puts one of its own, that lets all through, before them.
    """
    show = warnings.showwarning

    def show_the_rest(message: Warning | str, *args: Any, **kwargs: Any) -> None:
        if not any(word in str(message) for word in NOISE):
            show(message, *args, **kwargs)

    warnings.showwarning = show_the_rest
    from absl import logging  # slow to import

    logging.set_verbosity(logging.WARNING)  # dm_control tells which OpenGL it found


@contextlib.contextmanager
def noise_held_back() -> Iterator[None]:
    """The same for a while, such as an import: warnings are shown as before afterwards."""
    with warnings.catch_warnings():
        ignore_noise()
        yield


@contextlib.contextmanager
def standard_error_closed() -> Iterator[None]:
    """Lets nothing through to standard error, not even from below Python."""
    sys.stderr.flush()
    kept = os.dup(2)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)
