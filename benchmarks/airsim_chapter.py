"""The chapter's program through the messages of AirSim 1.1: an oracle, and a training."""

import importlib.util
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.airsim import served
from drone_rl.utils.intervals import proportion

EXAMPLE = Path(__file__).parents[1] / "examples" / "airsim_chapter.py"
MODES = {
    "wall": ("clock=wall", "Multirotor"),
    "lockstep": ("clock=lockstep", "Multirotor"),
    "computer vision": ("clock=wall", "ComputerVision"),
}
"""Clock and SimMode of each mode in which the oracle flies."""


def _example() -> Any:
    spec: Any = importlib.util.spec_from_file_location(EXAMPLE.stem, EXAMPLE)
    module: Any = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def bench_airsim_chapter(folder: Path, quick: bool) -> dict[str, Any]:
    """Run the chapter's program against `drone-rl serve`.

    Returns:
        "airsim_chapter_cubes": mean cubes of 3 over 20 resets, collected by an oracle that sees
        images only, in each of `MODES`; "airsim_chapter_lower95": success rate in 200 episodes of a
        policy that was trained through the client in lockstep, lower end of the exact interval;
        "airsim_chapter_minutes": duration of its training.
    """
    example = _example()
    cubes = []
    for mode, (clock, sim_mode) in MODES.items():
        settings = example.SETTINGS[sim_mode]
        with served(folder / mode, clock, settings=settings) as (port, _, _):
            cubes.append(_mean(_fly(example, port, 2 if quick else 20)))
    settings = example.SETTINGS["Multirotor"]
    with served(folder / "training", "clock=lockstep", settings=settings) as (port, _, _):
        client = example.Client(port=port)
        env, begin = example.ChapterEnv(client), time.perf_counter()
        act = example.train(env, **({"batches": 1, "frames": 600} if quick else {}))
        minutes = (time.perf_counter() - begin) / 60
        found = example.fly(env, act, 2 if quick else 200)
        client.close()
    successes = sum(number == env.num_cubes for number in found)
    return {
        "airsim_chapter_cubes": cubes,
        "airsim_chapter_lower95": proportion(successes, len(found)).lower95,
        "airsim_chapter_minutes": minutes,
    }


def _fly(example: Any, port: int, episodes: int) -> list[int]:
    """Return the cubes that the oracle collects in each episode."""
    client = example.Client(port=port)
    found = example.fly(example.ChapterEnv(client), example.oracle, episodes)
    client.close()
    return found


def _mean(values: Sequence[int]) -> float:
    return sum(values) / len(values)
