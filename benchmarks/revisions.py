"""Compare an earlier revision with the working tree by the same benchmarks on one machine."""

import statistics
import subprocess
import tarfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.benchmark import Setup
from benchmarks.commands import call
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import read_json

BEFORE = "c6d2d6dd"
"""The last revision before the code base was made smaller."""
NAMES = ("collector", "solve", "large", "memory", "explain", "startup")
"""Compared benchmarks."""
COSTS = (
    *("median_time_to_solve_s", "peak_memory_mib", "explain_s", "explain_peak_memory_mib"),
    *("import_s", "start_to_first_update_s", "verdict_s"),
)
"""Figures for which lower is better."""
RATES = ("collector_fps", "collector_fps_16", "learning_fps", "learning_fps_large")
"""Figures for which higher is better."""
Pair = tuple[Mapping[str, float], Mapping[str, float]]
"""Figures of the earlier and of the later revision."""
_ROOT = Path(__file__).resolve().parents[1]


def bench_revisions(setup: Setup) -> dict[str, Any]:
    """Run each benchmark of both revisions, one after the other, and compare the pairs.

    Each revision runs its own benchmarks in separate processes. The two measurements of a pair
    are minutes apart, because the speed of a shared machine changes within an hour.

    Returns:
        "ratio_before_after": cost ratio of each figure, see `compare`; "revisions": the figures
        of each pair.

    Raises:
        InputError: The earlier revision does not exist.
        RuntimeError: A benchmark failed.
    """
    folder = (setup.runs / "revisions").resolve()  # each revision runs in its own tree
    trees = {"before": extract(BEFORE, folder / "before"), "after": _ROOT}
    pairs: list[Pair] = []
    for i in range(1 if setup.quick else 3):
        for name in NAMES[:1] if setup.quick else NAMES:
            of = {tree: folder / f"{name}_{tree}_{i}" for tree in trees}
            both = {tree: measure(trees[tree], name, of[tree], setup.quick) for tree in trees}
            pairs.append((both["before"], both["after"]))
    return {
        "ratio_before_after": compare(pairs),
        "revisions": {"before": BEFORE, "pairs": [list(pair) for pair in pairs]},
    }


def extract(revision: str, target: Path) -> Path:
    """Write the files of a revision into a folder, unless the folder exists.

    Raises:
        InputError: The revision does not exist.
    """
    if target.is_dir():
        return target
    archive = target.with_suffix(".tar")
    archive.parent.mkdir(parents=True, exist_ok=True)
    command = ["git", "archive", "--output", str(archive), revision]
    process = subprocess.run(command, cwd=_ROOT, capture_output=True, text=True, check=False)
    if process.returncode:
        raise InputError(f"git has no revision {revision}: {process.stderr.strip()}")
    with tarfile.open(archive) as files:
        files.extractall(target, filter="data")
    archive.unlink()
    return target


def measure(tree: Path, name: str, folder: Path, quick: bool) -> dict[str, float]:
    """Run a benchmark of a tree in a separate process; return the compared figures."""
    places = (f"only=[{name}]", f"folder={folder}", f"hydra.run.dir={folder}/log")
    call("bench", f"quick={quick}".lower(), *places, tree=tree)
    figures = read_json(folder / ("quick" if quick else "") / "results.json", 2**24)
    return {key: figures[key] for key in (*COSTS, *RATES) if figures.get(key) is not None}


def compare(pairs: Sequence[Pair]) -> dict[str, float]:
    """Return the cost ratio of each figure, the median of all pairs that have it.

    It is after over before for a cost and before over after for a rate; 1.1 is ten percent worse.
    """
    ratios: dict[str, list[float]] = {}
    for before, after in pairs:
        for key in before.keys() & after.keys():
            low, high = (before, after) if key in COSTS else (after, before)
            ratios.setdefault(key, []).append(high[key] / low[key])
    keys = (key for key in (*COSTS, *RATES) if key in ratios)
    return {key: statistics.median(ratios[key]) for key in keys}
