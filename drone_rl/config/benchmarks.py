"""What benchmarks can be told."""

import dataclasses
from typing import Annotated

from drone_rl.utils.schema import Listed, Colors, Whole
from drone_rl.utils.settings import Settings


@dataclasses.dataclass(frozen=True, kw_only=True)
class BenchSettings(Settings):
    """What is measured, how thoroughly, and where."""

    only: Annotated[tuple[str, ...], Listed("benchmark")] | None = None
    """Which benchmarks to run; none for all that were not run yet with just this code."""
    quick: bool = False
    """A short form of each, for a first look; its figures are rough."""
    seeds: Annotated[tuple[int, ...], Several(Whole(0), 1, 1000)] = (0, 1, 2, 3, 4)
    """Seeds of the trainings that are timed."""
    episodes: Annotated[int, Whole(1, unit="episodes")] = 1000
    """Held-out episodes of each trained policy."""
    num_envs: Annotated[int, Whole(1, unit="worlds")] = 512
    """Worlds in a batch of the speed benchmarks."""
    memory_frames: Annotated[int, Whole(1, unit="frames")] = 1_000_000
    """Frames over which memory must stay flat."""
    device: str = "cpu"
    """Where worlds are drawn and policies run: cpu, cuda or cuda:N."""
    folder: str = "outputs/bench"
    """Folder of results.json and the plots."""
