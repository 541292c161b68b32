"""The speed of the chapter's own algorithm, its elements and signs, and policies with memory."""

import os
import re
import statistics
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchmarks.benchmark import Setup
from benchmarks.commands import call, train
from benchmarks.original import EPISODES
from benchmarks.revisions import extract
from drone_rl.cli.commands import COMMANDS
from drone_rl.utils.files import read_json

BEFORE = "3e5d8a0b"
"""The last revision that stepped the original network and camera in Python."""
NETWORKS = {"lstm": "lstm", "memoryless": "small_cnn"}
"""Networks that learn a task that needs memory, by the first part of their key."""
_ROOT = Path(__file__).resolve().parents[1]
_ELEMENT = re.compile(r"^\| ((?:Eq\.|Algorithm|Table|Listing|Fig\.) \d+) \|(.*)\|$", re.MULTILINE)
_COMMAND = re.compile(r"`drone-rl ([\w-]+)")
_TEST = re.compile(r"`(tests/\S+\.py)`")
_CONVENTIONS = "tests/flight/commands/test_conventions.py"


def bench_chapter(setup: Setup) -> dict[str, Any]:
    """Time `experiment=original`, and count elements and conventions.

    Returns:
        "original_minutes": minutes of 30,000 episodes that stop for no criterion;
        "original_speedup": frames per second over those of `BEFORE`; "chapter_elements",
        "chapter_shown", see `count_elements`; "convention_cases" that agree; "lstm_success",
        "memoryless_success", see `memory`.

    Raises:
        RuntimeError: A command or the tests of conventions failed.
    """
    folder = setup.runs / "chapter"
    elements, shown = count_elements(_ROOT / "docs" / "chapter.md", _ROOT)
    return {
        "original_minutes": minutes(folder / "whole", 100 if setup.quick else EPISODES),
        "original_speedup": speedup(folder / "speed", 1 if setup.quick else 3),
        "chapter_elements": elements,
        "chapter_shown": shown,
        "convention_cases": count_conventions(),
        **memory(folder / "memory", setup.quick),
    }


def memory(folder: Path, quick: bool) -> dict[str, float]:
    """Return the success of an LSTM and of a network without memory, of 1,000 greedy episodes.

    The task is that of `examples/recall.py`. Each is the median of three trainings.
    """
    paths = (str(_ROOT), os.environ.get("PYTHONPATH", ""))
    environment = {"PYTHONPATH": os.pathsep.join(filter(None, paths))}
    found, own = {}, ["plugins=[examples.recall]", "task=recall"]
    limit = ["trainer.total_frames=2000"] if quick else ["trainer.total_frames=400000"]
    for key, network in NETWORKS.items():
        rates = []
        for seed in range(1 if quick else 3):
            run = folder / f"{key}_{seed}"
            given = [*own, f"network={network}", f"seed={seed}", *limit]
            train(run, *given, environment=environment)
            judged = (f"policy={run}", own[0], "seed=0", f"hydra.run.dir={run}/evaluation")
            call("evaluate", *judged, "episodes=1000", environment=environment)
            evaluation = read_json(run / "evaluation" / "evaluation.json")
            rates.append(evaluation["greedy"]["success"]["share"])
        found[f"{key}_success"] = statistics.median(rates)
    return found


def minutes(folder: Path, episodes: int) -> float:
    """Return the minutes of 30,000 episodes, from so many that no criterion ends."""
    settings = ["experiment=original", "seed=0", "trainer.target_share=null"]
    seconds, _ = train(folder, *settings, f"trainer.total_episodes={episodes}")
    return seconds / 60 * EPISODES / episodes


def speedup(folder: Path, times: int) -> float:
    """Return frames per second of training, over those of `BEFORE`: medians of alternate runs."""
    trees = {"before": extract(BEFORE, folder.resolve() / "tree"), "after": _ROOT}
    rates: Mapping[str, list[float]] = {name: [] for name in trees}
    settings = ["experiment=original", "seed=0", "trainer.target_share=null"]
    settings.append("trainer.total_episodes=150")
    for i in range(times):
        for name, tree in trees.items():
            run = folder.resolve() / f"{name}_{i}"
            call("train", *settings, f"hydra.run.dir={run}", tree=tree)
            result = read_json(run / "result.json")
            rates[name].append(result["frames"] / result["seconds"])
    return statistics.median(rates["after"]) / statistics.median(rates["before"])


def count_elements(page: Path, root: Path) -> tuple[int, int]:
    """Return the number of rows of the page, and of those with a command or a test that exists."""
    rows = _ELEMENT.findall(page.read_text("utf-8"))
    shown = 0
    for _, cells in rows:
        commands, tests = _COMMAND.findall(cells), _TEST.findall(cells)
        exist = [name in COMMANDS for name in commands] + [(root / t).is_file() for t in tests]
        shown += bool(exist) and all(exist)
    return len(rows), shown


def count_conventions() -> int:
    """Return the number of hand-computed cases of signs and cameras that agree.

    Raises:
        RuntimeError: One does not.
    """
    command = [sys.executable, "-m", "pytest", "-q", _CONVENTIONS]
    done = subprocess.run(command, cwd=_ROOT, capture_output=True, text=True, check=False)
    passed = re.search(r"(\d+) passed", done.stdout)
    if done.returncode or passed is None:
        raise RuntimeError(f"the tests of conventions failed: {done.stdout.strip()[-500:]}")
    return int(passed[1])
