"""Frames per second of the renderer, the collector and dm_control's pixel observations."""

import dataclasses
import json
import os
import subprocess
import sys
from functools import partial
from typing import Any

import torch

from benchmarks.benchmark import Setup
from benchmarks.pipeline import default_collector, make_drone_env, paired, random_walk, rate
from drone_rl.config import AppearanceSettings
from drone_rl.envs import DroneEnv
from drone_rl.sim.rendering import View
from drone_rl.sim.rendering.view import MODALITIES
from drone_rl.sim.worlds import Worlds

SIZES = ((25, 64), (64, 64), (100, 256))
"""Heights and widths at which renderers are compared."""
_COMPARED_ENVS = 128
BLOCKS = AppearanceSettings(
    sun_elevation=40.0,
    sun_azimuth=140.0,
    sun_color=(1.0, 0.96, 0.88),
    ambient_strength=0.42,
    shadows=1.0,
    sky_horizon=(0.8, 0.87, 0.94),
    sky_zenith=(0.25, 0.46, 0.8),
    fog_visibility=400.0,
    ground_color=(0.62, 0.63, 0.62),
    ground_texture="grid",
    object_texture="bricks",
    distractors=26,
    distractor_size=(1.5, 5.0),
    distractor_distance=(1.5, 24.0),
)
"""`appearance=blocks`: with the ground and three cubes, 30 geoms."""
_COLLECTED = (16, 32, 64, 128, 256)
"""Batch sizes at which the collector is measured."""


def bench_render(setup: Setup) -> dict[str, Any]:
    """Measure the renderer on a batch of environments, on all cores.

    Returns:
        Frames per second at 25x64 and 64x64 pixels, and at 64x64 with `appearance=blocks`; the
        speed relative to MuJoCo Warp's renderer; the time of a pass with all modalities divided by
        that of an RGB pass.
    """
    seconds = 0.5 if setup.quick else 10.0
    env = make_drone_env(setup.num_envs, setup.device)
    env.reset()
    frames = rate(partial(_render, env.worlds), seconds)
    larger = partial(_render, env.worlds, env.worlds.view(height=64, width=64))
    frames_64 = rate(larger, seconds)
    env.close()
    blocks = make_drone_env(setup.num_envs, setup.device, appearance=BLOCKS)
    blocks.reset()
    frames_blocks = rate(partial(_render_appearance, blocks), seconds)
    blocks.close()
    return {
        "raw_render_fps": frames,
        "raw_render_fps_64": frames_64,
        "raw_render_blocks_fps_64": frames_blocks,
        "render_over_warp": {
            f"{h}x{w}": _over_warp(h, w, setup.device, seconds / 10) for h, w in SIZES
        },
        "render_all_over_rgb": _all_over_rgb(setup.device, seconds / 20),
    }


def _all_over_rgb(device: str, seconds: float) -> float:
    """Return the time of a pass with all modalities divided by that of an RGB pass."""
    env = make_drone_env(_COMPARED_ENVS, device)
    env.reset()
    view = env.worlds.view(modality=MODALITIES, height=64, width=64)
    work = [partial(_render, env.worlds, dataclasses.replace(view, modalities=("rgb",)))]
    work.append(partial(_render, env.worlds, view))
    for render in work:
        render()
    _, _, ratio = paired(*work, seconds=seconds, rounds=9)
    env.close()
    return ratio


def _over_warp(height: int, width: int, device: str, seconds: float) -> float:
    """Return the speed of the default renderer divided by that of MuJoCo Warp's renderer."""
    ours, theirs = (
        make_drone_env(_COMPARED_ENVS, device, renderer=renderer)
        for renderer in ("raytrace", "mujoco_warp")
    )
    view = ours.worlds.view(height=height, width=width)
    work = [partial(_render, env.worlds, view) for env in (ours, theirs)]
    for env in (ours, theirs):
        env.reset()
    for render in work:
        render()
    _, _, ratio = paired(*work, seconds=seconds, rounds=3)
    for env in (ours, theirs):
        env.close()
    return ratio


def _render_appearance(env: DroneEnv) -> int:
    """Render every environment with its own appearance at 64x64 pixels."""
    every = torch.arange(env.worlds.num_envs)
    view = env.worlds.view(height=64, width=64)
    return len(env.worlds.render(env.worlds.state, view, env.appearances.current(every)))


def _render(worlds: Worlds, view: View | None = None) -> int:
    images = worlds.render_all(worlds.state, view or worlds.policy_view)
    return len(next(iter(images.values())))


def bench_collector(setup: Setup) -> dict[str, Any]:
    """Measure the default collector, with policy and transforms.

    It is compared with MuJoCo Warp's renderer, which limited the speed before the ray tracer.

    Returns:
        Frames per second at the fastest batch size, this size, frames per second with 16
        environments, those of MuJoCo Warp, and the ratio to these.
    """
    seconds = 0.5 if setup.quick else 4.0
    rates = {count: _collected(count, setup.device, seconds) for count in _COLLECTED}
    best = max(rates, key=lambda count: rates[count])
    env = make_drone_env(setup.num_envs, setup.device, renderer="mujoco_warp")
    env.reset()
    collector = default_collector(best, setup.device)
    collector.collect()
    collected, rendered, ratio = paired(
        lambda: len(collector.collect()),
        lambda: _render(env.worlds),
        seconds=seconds,
        rounds=1 if setup.quick else 9,
    )
    collector.shutdown()
    env.close()
    return {
        "collector_fps": collected,
        "collector_worlds": best,
        "collector_fps_16": rates[16],
        "raw_render_beside_collector_fps": rendered,
        "collector_over_raw": ratio,
    }


def _collected(num_envs: int, device: str, seconds: float) -> float:
    """Return the frames per second of the default collector."""
    collector = default_collector(num_envs, device)
    collector.collect()
    collected = rate(lambda: len(collector.collect()), seconds)
    collector.shutdown()
    return collected


def bench_dm_control(setup: Setup) -> dict[str, Any]:
    """Compare the batched environment with dm_control's pixel observations, default and tuned."""
    env = make_drone_env(setup.num_envs, setup.device)
    seconds = 0.5 if setup.quick else 5.0
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
    """Return the frames per second of dm_control; None without EGL."""
    command = [sys.executable, "-m", "benchmarks.dm_control", quality, str(seconds)]
    environment = {**os.environ, "MUJOCO_GL": "egl"}
    process = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    if process.returncode != 0:
        return None
    return json.loads(process.stdout.strip().splitlines()[-1])["frames_per_second"]
