"""Definition of a benchmark, and the setup of a measurement."""

import dataclasses
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Self

from drone_rl.config.commands import BenchSettings

Figures = Mapping[str, Any]
"""Plain values by key. No two benchmarks return the same key."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Setup:
    """Folder, device and sizes of a measurement."""

    folder: Path
    """Folder of the results; `runs` is below it."""
    quick: bool
    """Whether to take a short, rough measurement."""
    device: str
    """Device of rendering and policies: cpu, cuda or cuda:N."""
    num_envs: int
    """Environments in a batch of the speed benchmarks."""
    seeds: tuple[int, ...]
    """Seeds of the timed trainings."""
    episodes: int
    """Held-out episodes that evaluate each trained policy."""
    memory_frames: int
    """Number of frames over which memory must not grow."""

    @classmethod
    def from_settings(cls, settings: BenchSettings, folder: Path) -> Self:
        """Return the setup that the settings of `drone-rl bench` describe; small sizes if quick.

        Args:
            settings: Settings of the command.
            folder: Folder of the results.
        """
        quick = settings.quick
        return cls(
            folder=folder.absolute(),  # commands run in other folders
            quick=quick,
            device=settings.device,
            num_envs=64 if quick else settings.num_envs,
            seeds=settings.seeds[:1] if quick else settings.seeds,
            episodes=50 if quick else settings.episodes,
            memory_frames=10_000 if quick else settings.memory_frames,
        )

    @property
    def runs(self) -> Path:
        """Working folder of the commands that benchmarks run."""
        return self.folder / "work"  # runs/ holds the logs of drone-rl bench itself


@dataclasses.dataclass(frozen=True)
class Benchmark:
    """A function that measures figures, and the code that it measures."""

    run: Callable[[Setup], Figures]
    """Measure and return the figures."""
    group: str
    """Name of the group of benchmarks that it belongs to."""
    measures: tuple[str, ...]
    """Packages and modules of drone_rl, modules of benchmarks, and conf. If one of them changes,
    the figures are out of date."""
