"""`drone-rl bench`."""

import json
import logging
from pathlib import Path

from omegaconf import DictConfig

from drone_rl.bench.benchmark import Setup
from drone_rl.bench.ledger import Ledger
from drone_rl.bench.registry import BENCHMARKS, find_benchmarks
from drone_rl.bench.run import run_benchmarks
from drone_rl.utils.errors import InputError

_log = logging.getLogger(__name__)


def prepare(overrides: list[str]) -> list[str]:
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


def run(config: DictConfig) -> tuple[int, None]:
    """Runs benchmarks; each adds to results.json when it is done.

    Raises:
        InputError: One failed; those after it were run all the same.
    """
    folder = Path(config.folder) / "quick" if config.quick else Path(config.folder)
    folder.mkdir(parents=True, exist_ok=True)
    setup = Setup(
        folder=folder,
        quick=config.quick,
        device=config.device,
        num_envs=config.num_envs,
        seeds=tuple(config.seeds),
        episodes=config.episodes,
        memory_frames=config.memory_frames,
    )
    ledger = Ledger(folder / "results.json")
    names = list(BENCHMARKS) if config.only is None else find_benchmarks(config.only)
    failures = run_benchmarks(names, setup, ledger, again=config.only is not None)
    print(json.dumps({name: ledger.of(name) for name in names}, indent=2))
    _log.info("results: %s", ledger.path)
    if failures:
        reasons = "; ".join(f"{name}: {why}" for name, why in failures.items())
        raise InputError(f"benchmarks failed: {reasons}")
    return 0, None
