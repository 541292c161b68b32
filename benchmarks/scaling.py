"""Time of a rollout against the numbers of environments, frames, cubes and pixels."""

import statistics
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.benchmark import Setup
from benchmarks.pipeline import make_drone_env, random_walk
from drone_rl.config import CameraSettings
from drone_rl.utils.palette import INK, MUTED, css


def bench_scaling(setup: Setup) -> dict[str, Any]:
    """Measure the time of random rollouts for several sizes and plot it to scaling.png.

    Time must grow linearly with the numbers of environments, frames, cubes and pixels.

    Returns:
        For each of the four the sizes, the seconds and the R² of a straight line.
    """
    num_envs = (32, 64, 128) if setup.quick else (32, 64, 128, 256, 512)
    cubes = (1, 4, 8) if setup.quick else (1, 2, 4, 8, 16)
    larger = range(1, 4 if setup.quick else 6)
    cameras = [CameraSettings(width=64 * k, height=25 * k) for k in larger]
    steps = 5 if setup.quick else 20
    series = {
        "environments": {
            n: _seconds(make_drone_env(n, setup.device), steps, setup.quick) for n in num_envs
        },
        "frames": {
            64 * k * steps: _seconds(make_drone_env(64, setup.device), k * steps, setup.quick)
            for k in ((1, 2, 3) if setup.quick else (1, 2, 4, 8))
        },
        "cubes": {
            n: _seconds(make_drone_env(128, setup.device, n), steps, setup.quick) for n in cubes
        },
        "pixels": {
            c.width * c.height: _seconds(
                make_drone_env(128, setup.device, camera=c), steps, setup.quick
            )
            for c in cameras
        },
    }
    _plot(series, setup.folder / "scaling.png")
    results = {}
    for name, points in series.items():
        sizes, seconds = list(points), list(points.values())
        results[name] = {"sizes": sizes, "seconds": seconds, "r_squared": _r_squared(points)}
    return {"scaling": results}


def _seconds(env: Any, steps: int, quick: bool) -> float:
    """Return the median time of a few random rollouts."""
    random_walk(env, 2)
    times = []
    for _ in range(1 if quick else 5):
        begin = time.perf_counter()
        random_walk(env, steps)
        times.append(time.perf_counter() - begin)
    env.close()
    return statistics.median(times)


def _r_squared(points: dict[int, float]) -> float:
    x, y = np.array(list(points)), np.array(list(points.values()))
    fitted = np.polyval(np.polyfit(x, y, 1), x)
    return float(1 - ((y - fitted) ** 2).sum() / ((y - y.mean()) ** 2).sum())


def _plot(series: dict[str, dict[int, float]], path: Path) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(14, 3.4), layout="constrained")
    figure.suptitle("Time of a rollout of random actions, rendering included")
    for axes, (name, points) in zip(figure.subplots(1, len(series)), series.items(), strict=True):
        x, y = np.array(list(points)), np.array(list(points.values()))
        line = np.polyfit(x, y, 1)
        grid = np.linspace(0, x.max(), 50)
        axes.plot(grid, np.polyval(line, grid), color=css(MUTED), label="straight line")
        axes.plot(x, y, "o", color=css(INK), label="measured")
        axes.set(xlabel=f"number of {name}", ylabel="seconds", ylim=(0, 1.1 * y.max()))
        axes.legend()
    figure.savefig(path, dpi=120)
