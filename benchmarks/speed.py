"""Frames a second: drawing alone, the collector, and dm_control's own pixel path."""

import dataclasses
import json
import os
import subprocess
import sys
from functools import partial
from typing import Any

import torch

from benchmarks.pipeline import default_collector, make_worlds, paired, random_walk, rate
from drone_rl.config import AppearanceSettings
from drone_rl.envs import DroneEnv
from drone_rl.sim.rendering import View
from drone_rl.sim.rendering.view import MODALITIES
from drone_rl.sim.worlds import Worlds

SIZES = ((25, 64), (64, 64), (100, 256))
"""Heights and widths at which renderers are compared."""
_COMPARED_WORLDS = 128
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
"""Numbers of worlds that are tried."""


def bench_render(num_envs: int, device: str, quick: bool) -> dict[str, Any]:
    """Raw drawing of a batch of worlds on all cores.

    Returns:
        Frames a second at 25x64 and 64x64 pixels, and at the latter with `appearance=blocks`; how
        many times as many as by MuJoCo Warp's renderer, and the time of all modalities in one pass
        over that of RGB.
    """
    seconds = 0.5 if quick else 10.0
    env = make_worlds(num_envs, device)
    env.reset()
    frames = rate(partial(_draw, env.worlds), seconds)
    larger = partial(_draw, env.worlds, env.worlds.view(height=64, width=64))
    frames_64 = rate(larger, seconds)
    env.close()
    blocks = make_worlds(num_envs, device, appearance=BLOCKS)
    blocks.reset()
    frames_blocks = rate(partial(_draw_looks, blocks), seconds)
    blocks.close()
    return {
        "raw_render_fps": frames,
        "raw_render_fps_64": frames_64,
        "raw_render_blocks_fps_64": frames_blocks,
        "render_over_warp": {f"{h}x{w}": _over_warp(h, w, device, seconds / 10) for h, w in SIZES},
        "render_all_over_rgb": _all_over_rgb(device, seconds / 20),
    }


def _all_over_rgb(device: str, seconds: float) -> float:
    """Time of a picture of all modalities over that of one in colours, in turn."""
    env = make_worlds(_COMPARED_WORLDS, device)
    env.reset()
    view = env.worlds.view(modality=MODALITIES, height=64, width=64)
    work = [partial(_draw, env.worlds, dataclasses.replace(view, modalities=("rgb",)))]
    work.append(partial(_draw, env.worlds, view))
    for draw in work:
        draw()
    _, _, ratio = paired(*work, seconds=seconds, rounds=9)
    env.close()
    return ratio


def _over_warp(height: int, width: int, device: str, seconds: float) -> float:
    """Frames a second of the default renderer over those of MuJoCo Warp's, in turn."""
    ours, theirs = (
        make_worlds(_COMPARED_WORLDS, device, renderer=renderer)
        for renderer in ("raytrace", "mujoco_warp")
    )
    view = ours.worlds.view(height=height, width=width)
    work = [partial(_draw, env.worlds, view) for env in (ours, theirs)]
    for env in (ours, theirs):
        env.reset()
    for draw in work:
        draw()
    _, _, ratio = paired(*work, seconds=seconds, rounds=3)
    for env in (ours, theirs):
        env.close()
    return ratio


def _draw_looks(env: DroneEnv) -> int:
    """Draws every world as it looks, at 64x64 pixels."""
    every = torch.arange(env.worlds.num_worlds)
    view = env.worlds.view(height=64, width=64)
    return len(env.worlds.render(env.worlds.state, view, env.looks.drawn(every)))


def _draw(worlds: Worlds, view: View | None = None) -> int:
    pictures = worlds.render_all(worlds.state, view or worlds.policy_view)
    return len(next(iter(pictures.values())))


def bench_collector(num_envs: int, device: str, quick: bool) -> dict[str, Any]:
    """The collector, policy and pipeline included, over MuJoCo Warp's drawing of a batch.

    That drawing alone was the limit until our own ray tracer took its place.

    Args:
        num_envs: Worlds that MuJoCo Warp draws.
        device: See `Setup`.
        quick: See `Setup`.

    Returns:
        Frames a second with as many worlds as are fastest, and how many these are; with 16; and of
        drawing.
    """
    seconds = 0.5 if quick else 4.0
    rates = {count: _collected(count, device, seconds) for count in _COLLECTED}
    best = max(rates, key=lambda count: rates[count])
    env = make_worlds(num_envs, device, renderer="mujoco_warp")
    env.reset()
    collector = default_collector(best, device)
    collector.collect()
    collected, drawn, ratio = paired(
        lambda: len(collector.collect()),
        lambda: _draw(env.worlds),
        seconds=seconds,
        rounds=1 if quick else 9,
    )
    collector.shutdown()
    env.close()
    return {
        "collector_fps": collected,
        "collector_worlds": best,
        "collector_fps_16": rates[16],
        "raw_render_beside_collector_fps": drawn,
        "collector_over_raw": ratio,
    }


def _collected(num_envs: int, device: str, seconds: float) -> float:
    """Frames a second of the default's collector, with so many worlds."""
    collector = default_collector(num_envs, device)
    collector.collect()
    collected = rate(lambda: len(collector.collect()), seconds)
    collector.shutdown()
    return collected


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
    command = [sys.executable, "-m", "benchmarks.dm_control", quality, str(seconds)]
    environment = {**os.environ, "MUJOCO_GL": "egl"}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    if done.returncode != 0:
        return None
    return json.loads(done.stdout.strip().splitlines()[-1])["frames_per_second"]
