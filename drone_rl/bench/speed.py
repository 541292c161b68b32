"""Frames a second: drawing alone, the collector, and dm_control's own pixel path."""

import json
import os
import subprocess
import sys
from typing import Any

from drone_rl.bench.parts import default_collector, make_worlds, paired, random_walk, rate


def bench_render(num_envs: int, device: str, quick: bool) -> dict[str, Any]:
    """Raw drawing of a batch of worlds on all cores, at 25x64 pixels."""
    env = make_worlds(num_envs, device)
    env.reset()
    worlds = env.worlds
    frames = rate(lambda: len(worlds.render(worlds.state)), 2.0 if quick else 10.0)
    env.close()
    return {"raw_render_fps": frames}


def bench_collector(num_envs: int, num_threads: int, device: str, quick: bool) -> dict[str, Any]:
    """The collector, policy and pipeline included, over raw drawing of the same batch."""
    env = make_worlds(num_envs, device)
    env.reset()
    worlds, collector = env.worlds, default_collector(num_envs, num_threads, device)
    collector.collect()
    collected, drawn, ratio = paired(
        lambda: len(collector.collect()),
        lambda: len(worlds.render(worlds.state)),
        seconds=1.0 if quick else 4.0,
        rounds=1 if quick else 9,
    )
    collector.shutdown()
    env.close()
    return {
        "collector_fps": collected,
        "raw_render_beside_collector_fps": drawn,
        "collector_over_raw": ratio,
    }


def bench_dm_control(num_envs: int, device: str, quick: bool) -> dict[str, Any]:
    """The batched environment over dm_control's pixel path, as it comes and tuned by hand."""
    env = make_worlds(num_envs, device)
    seconds = 0.5 if quick else 5.0
    results: dict[str, Any] = {}
    random_walk(env, 2)
    for quality, name in (("default", ""), ("tuned", "_tuned")):
        batched = rate(lambda: random_walk(env, 10), seconds)
        single = _dm_control_rate(quality, seconds)
        results[f"dm_control{name}_fps"] = single
        results[f"batched_over_dm_control{name}"] = batched / single if single else None
        results["batched_env_fps"] = batched
    env.close()
    return results


def _dm_control_rate(quality: str, seconds: float) -> float | None:
    """None where there is no EGL."""
    command = [sys.executable, "-m", "drone_rl.bench.dm_control", quality, str(seconds)]
    environment = {**os.environ, "MUJOCO_GL": "egl"}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    if done.returncode != 0:
        return None
    return json.loads(done.stdout.strip().splitlines()[-1])["frames_per_second"]
