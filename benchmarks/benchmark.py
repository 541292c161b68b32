"""A benchmark: what it runs, and the code that its figures are of."""

import dataclasses
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Self

import torch

from drone_rl.config.commands import BenchSettings

Figures = Mapping[str, Any]
"""Plain values by key. No two benchmarks make the same key."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Setup:
    """Where and how thoroughly to measure."""

    folder: Path
    """Of the results; runs of commands are kept below it."""
    quick: bool
    """Whether a rough figure will do."""
    device: str
    """Where worlds are drawn and policies run: cpu, cuda or cuda:N."""
    num_envs: int
    """Worlds in a batch of the speed benchmarks; a quick one takes 64."""
    seeds: tuple[int, ...]
    """Of the trainings that are timed."""
    episodes: int
    """Held-out ones of each trained policy."""
    memory_frames: int
    """Over which memory must stay flat."""

    @classmethod
    def of(cls, settings: BenchSettings, folder: Path) -> Self:
        """What the settings ask for.

        Args:
            settings: The command's.
            folder: Of the results.
        """
        return cls(
            folder=folder,
            quick=settings.quick,
            device=settings.device,
            num_envs=settings.num_envs,
            seeds=settings.seeds,
            episodes=settings.episodes,
            memory_frames=settings.memory_frames,
        )

    @property
    def worlds(self) -> int:
        """Worlds in a batch."""
        return 64 if self.quick else self.num_envs

    @property
    def threads(self) -> int:
        """That draw."""
        return 1 if self.device.startswith("cuda") else torch.get_num_threads()

    @property
    def runs(self) -> Path:
        """Folder of what commands leave."""
        return self.folder / "work"  # runs/ holds the logs of drone-rl bench itself


@dataclasses.dataclass(frozen=True)
class Benchmark:
    """One that runs alone."""

    run: Callable[[Setup], Figures]
    """Measures."""
    group: str
    """Those that are run by one name."""
    measures: tuple[str, ...]
    """Packages and modules of drone_rl, modules of benchmarks, and conf, that decide its figures:
    when one changes, the figures are out of date."""
