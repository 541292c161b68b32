"""`drone-rl bench`."""

import json
import logging
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import torch
from omegaconf import DictConfig

from drone_rl.bench.coverage import bench_coverage
from drone_rl.bench.explain import bench_explain
from drone_rl.bench.hostile import bench_hostile
from drone_rl.bench.maps import bench_maps
from drone_rl.bench.mutants import bench_mutants
from drone_rl.bench.scaling import bench_scaling
from drone_rl.bench.sentences import bench_sentences
from drone_rl.bench.speed import bench_collector, bench_dm_control, bench_render
from drone_rl.bench.sweeps import bench_kills, bench_ray, bench_sweeps
from drone_rl.bench.training import bench_memory, bench_solve
from drone_rl.bench.verdicts import bench_verdicts
from drone_rl.utils.errors import InputError
from drone_rl.utils.provenance import provenance

MAIN_JOB = ("render", "collector", "dm_control", "scaling", "memory", "solve")
"""What `--quick` runs when nothing is named: in a minute or little more."""
TRUTH = ("coverage", "sentences", "hostile", "maps", "explain", "verdicts", "mutants")
"""What `drone-rl bench truth` runs: whether what the program says holds against an adversary."""
NAMES = (*MAIN_JOB, *TRUTH, "sweeps", "kills", "ray")
GROUPS = {"truth": TRUTH}
"""Several benchmarks under one name."""
_log = logging.getLogger(__name__)


def prepare(overrides: list[str]) -> list[str]:
    """Makes `drone-rl bench collector --quick` mean `only=[collector] quick=true`."""
    names = [name for o in overrides for name in GROUPS.get(o, (o,)) if name in NAMES]
    kept = [o for o in overrides if o not in (*NAMES, *GROUPS, "--quick")]
    for override in kept:
        if "=" not in override and not override.startswith("-"):
            known = ", ".join((*GROUPS, *NAMES))
            raise InputError(f"benchmark {override!r} is unknown; use some of: {known}")
    quick = "--quick" in overrides
    if quick and not names and not any(o.startswith("only=") for o in kept):
        names = list(MAIN_JOB)
    if names:
        kept.append(f"only=[{','.join(names)}]")
    return [*kept, "quick=true"] if quick else kept


def run(config: DictConfig) -> tuple[int, None]:
    """Runs benchmarks one after the other; each adds to results.json when it is done."""
    unknown = [name for name in config.only if name not in NAMES]
    if unknown:
        raise InputError(f"only={unknown} is unknown; use some of: {', '.join(NAMES)}")
    folder = Path(config.folder) / "quick" if config.quick else Path(config.folder)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "results.json"
    benchmarks = _benchmarks(config, folder)
    for name in config.only:
        _log.info("benchmark: %s", name)
        results = json.loads(path.read_text()) if path.exists() else {}
        results |= benchmarks[name]()
        results |= {"quick": config.quick, "device": config.device, **provenance()}
        path.write_text(json.dumps(results, indent=2))
    print(json.dumps({k: v for k, v in results.items() if k not in ("versions",)}, indent=2))
    _log.info("written: %s", path)
    return 0, None


def _benchmarks(config: DictConfig, folder: Path) -> dict[str, Callable[[], dict[str, Any]]]:
    device, quick = config.device, config.quick
    worlds = 64 if quick else config.num_envs
    threads = 1 if device.startswith("cuda") else torch.get_num_threads()
    runs = folder / "runs"
    shutil.rmtree(runs, ignore_errors=True)
    return {
        "render": lambda: bench_render(worlds, device, quick),
        "collector": lambda: bench_collector(worlds, threads, device, quick),
        "dm_control": lambda: bench_dm_control(worlds, device, quick),
        "scaling": lambda: bench_scaling(folder, device, quick),
        "memory": lambda: bench_memory(runs, config.memory_frames, device, quick),
        "solve": lambda: bench_solve(runs, list(config.seeds), config.episodes, device, quick),
        "coverage": lambda: bench_coverage(quick),
        "sentences": lambda: bench_sentences(),
        "hostile": lambda: bench_hostile(runs / "hostile"),
        "maps": lambda: bench_maps(runs, quick),
        "mutants": lambda: bench_mutants(),
        "explain": lambda: bench_explain(runs, quick),
        "verdicts": lambda: bench_verdicts(runs, device, quick),
        "sweeps": lambda: bench_sweeps(runs, device, quick),
        "kills": lambda: bench_kills(runs, device, quick),
        "ray": lambda: bench_ray(runs, device, quick),
    }
