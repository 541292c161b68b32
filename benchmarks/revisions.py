"""Compare an earlier revision with the working tree by the same benchmarks on one machine."""

import statistics
import subprocess
import tarfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.commands import call
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import read_json

BEFORE = "b3e55cd"
"""The last revision before modules moved into packages by feature."""
NAMES = ("collector", "solve", "large", "memory", "explain", "startup")
"""Compared benchmarks."""
COSTS = (
    *("median_time_to_solve_s", "peak_memory_mib", "explain_s", "explain_peak_memory_mib"),
    *("import_s", "start_to_first_update_s", "verdict_s"),
)
"""Figures for which lower is better."""
RATES = ("collector_fps", "collector_fps_16", "learning_fps", "learning_fps_large")
"""Figures for which higher is better."""
_ROOT = Path(__file__).resolve().parents[1]


def bench_revisions(
    folder: Path, quick: bool, *, before: str = BEFORE, root: Path = _ROOT
) -> dict[str, Any]:
    """Run the benchmarks of both revisions alternately and compare the medians.

    Each revision runs its own benchmarks in separate processes.

    Args:
        folder: Folder of the earlier tree and all results.
        quick: Whether to run once in quick mode instead of three times.
        before: The earlier revision, as git names it.
        root: Checkout of the later revision.

    Returns:
        "ratio_before_after": cost ratio of each figure: seconds and memory after / before, frames
        per second before / after; "revisions": the medians of both revisions.

    Raises:
        InputError: The earlier revision does not exist.
        RuntimeError: A benchmark failed.
    """
    folder = folder.resolve()  # each revision runs in its own tree
    trees = {"before": extract(before, folder / "before", root), "after": root}
    names = NAMES[:1] if quick else NAMES
    found: dict[str, list[Mapping[str, float]]] = {name: [] for name in trees}
    for i in range(1 if quick else 3):
        for name, tree in trees.items():
            found[name].append(measure(tree, names, folder / f"{name}_{i}", quick))
    medians = {name: _medians(figures) for name, figures in found.items()}
    return {
        "ratio_before_after": compare(medians["before"], medians["after"]),
        "revisions": {"before": before, **{f"{k}_figures": v for k, v in medians.items()}},
    }


def extract(revision: str, target: Path, root: Path = _ROOT) -> Path:
    """Write the files of a revision into a folder, unless the folder exists.

    Raises:
        InputError: The revision does not exist.
    """
    if target.is_dir():
        return target
    archive = target.with_suffix(".tar")
    archive.parent.mkdir(parents=True, exist_ok=True)
    command = ["git", "archive", "--output", str(archive), revision]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True, check=False)
    if done.returncode:
        raise InputError(f"git has no revision {revision}: {done.stderr.strip()}")
    with tarfile.open(archive) as files:
        files.extractall(target, filter="data")
    archive.unlink()
    return target


def measure(tree: Path, names: Sequence[str], folder: Path, quick: bool) -> dict[str, float]:
    """Run benchmarks of a tree in a separate process; return the compared figures."""
    only = f"only=[{','.join(names)}]"
    places = (f"folder={folder}", f"hydra.run.dir={folder}/log")
    call("bench", only, f"quick={quick}".lower(), *places, tree=tree)
    figures = read_json(folder / ("quick" if quick else "") / "results.json", 2**24)
    return {key: figures[key] for key in (*COSTS, *RATES) if figures.get(key) is not None}


def compare(before: Mapping[str, float], after: Mapping[str, float]) -> dict[str, float]:
    """Return the cost ratio of each figure, after over before; 1.1 is ten percent worse."""
    both = before.keys() & after.keys()
    return {
        **{key: after[key] / before[key] for key in COSTS if key in both},
        **{key: before[key] / after[key] for key in RATES if key in both},
    }


def _medians(figures: Sequence[Mapping[str, float]]) -> dict[str, float]:
    return {key: statistics.median(each[key] for each in figures) for key in figures[0]}
