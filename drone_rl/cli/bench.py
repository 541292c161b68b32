"""`drone-rl bench`."""

import dataclasses
import json
import logging
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from drone_rl.bench.benchmark import Setup
from drone_rl.bench.ledger import Ledger
from drone_rl.bench.registry import BENCHMARKS, find_benchmarks
from drone_rl.bench.run import run_benchmarks
from drone_rl.settings.paths import PathsSettings
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Listed, Several, Whole
from drone_rl.utils.settings import Settings, kinds_of

_log = logging.getLogger(__name__)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Command(Settings):
    """What `drone-rl bench` can be told."""

    only: Annotated[tuple[str, ...], Listed("benchmark")] | None = None
    """Which benchmarks to run; none for all that were not run yet with just this code."""
    quick: bool = False
    """A short form of each, for a first look; its figures are rough."""
    seeds: Annotated[tuple[int, ...], Several(Whole(0), 1, 1000)] = (0, 1, 2, 3, 4)
    """Seeds of the trainings that are timed."""
    episodes: Annotated[int, Whole(1)] = 1000
    """Held-out episodes of each trained policy."""
    num_envs: Annotated[int, Whole(1)] = 512
    """Worlds in a batch of the speed benchmarks."""
    memory_frames: Annotated[int, Whole(1)] = 1_000_000
    """Frames over which memory must stay flat."""
    device: str = "cpu"
    """Where worlds are drawn and policies run: cpu, cuda or cuda:N."""
    folder: str = "outputs/bench"
    """Folder of results.json and the plots."""
    paths: PathsSettings = PathsSettings()
    """Folders."""


def prepare(overrides: Sequence[str]) -> list[str]:
    """Makes `drone-rl bench collector --quick` mean `only=[collector] quick=true`."""
    words = [o for o in overrides if "=" not in o and not o.startswith("-")]
    names = find_benchmarks(words)
    kept = [o for o in overrides if o not in (*words, "--quick")]
    quick = "--quick" in overrides
    if quick and not names and not any(o.startswith("only=") for o in kept):
        names = find_benchmarks(["main"])
    if names:
        kept.append(f"only=[{','.join(names)}]")
    return [*kept, "quick=true"] if quick else kept


def run(settings: Command, output_dir: Path) -> tuple[int, None]:
    """Runs benchmarks; each adds to results.json when it is done.

    Raises:
        InputError: One failed; those after it were run all the same.
    """
    del output_dir
    folder = Path(settings.folder) / "quick" if settings.quick else Path(settings.folder)
    folder.mkdir(parents=True, exist_ok=True)
    told = {n: getattr(settings, n) for n in kinds_of(Command) if n in Setup.__annotations__}
    ledger = Ledger(folder / "results.json")
    names = list(BENCHMARKS) if settings.only is None else find_benchmarks(settings.only)
    setup = Setup(**told | {"folder": folder})
    failures = run_benchmarks(names, setup, ledger, again=settings.only is not None)
    print(json.dumps({name: ledger.of(name) for name in names}, indent=2))
    _log.info("results: %s", ledger.path)
    if failures:
        reasons = "; ".join(f"{name}: {why}" for name, why in failures.items())
        raise InputError(f"benchmarks failed: {reasons}")
    return 0, None
