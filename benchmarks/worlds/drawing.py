"""Speed of drawing and collecting in the indoor scene, next to MuJoCo Warp and OpenGL.

Run as a program (`python -m benchmarks.worlds.drawing SECONDS ROUNDS`) with MUJOCO_GL=egl, because
MuJoCo chooses OpenGL's platform when it is imported.
"""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from typing import Any

import mujoco as _mujoco
import torch

from benchmarks.benchmark import Setup
from benchmarks.pipeline import paired
from benchmarks.worlds.house import put_at_random, reach
from drone_rl.config import CameraSettings
from drone_rl.config.learning import Gae, Ppo, Rollouts
from drone_rl.config.training import TrainSettings
from drone_rl.config.transforms import Gray, Standardize
from drone_rl.sim.tasks import State
from drone_rl.sim.worlds import Worlds
from drone_rl.training.train import make_collector

mujoco: Any = _mujoco
"""MuJoCo's bindings, which are untyped."""
PLACES = 256
"""Random free places and headings, the same for all renderers."""
CAMERA = CameraSettings(width=64, height=64)
_PLAIN = ("SHADOW", "REFLECTION", "FOG", "HAZE")
"""What OpenGL leaves out."""


def bench_drawing(setup: Setup) -> dict[str, Any]:
    """Compare renderers and the collector in one process, in turns.

    Returns:
        "world_over_warp", the speed at 64x64 pixels divided by that of MuJoCo Warp's renderer;
        "world_over_opengl", by that of MuJoCo's OpenGL without shadows and multisampling (None
        without EGL); "world_collecting_over_warp", the rate of a collector with a policy of the
        default's size divided by that of MuJoCo Warp's renderer alone; "world_fps", frames per
        second of all that were measured.
    """
    sizes = ["0.3", "3"] if setup.quick else ["2", "9"]
    for platform in ("egl", "disabled"):
        process = subprocess.run(
            [sys.executable, "-m", "benchmarks.worlds.drawing", *sizes, platform],
            capture_output=True,
            text=True,
            env={**os.environ, "MUJOCO_GL": platform},
            check=False,
        )
        if process.returncode == 0:
            return json.loads(process.stdout.splitlines()[-1])
    raise RuntimeError(f"drawing the indoor scene failed: {process.stderr.strip()[-500:]}")


def measure(seconds: float, rounds: int, has_opengl: bool) -> dict[str, Any]:
    """Return the figures of `bench_drawing`."""
    ours, theirs = (
        Worlds(PLACES, reach(), CAMERA, renderer=name) for name in ("raytrace", "mujoco_warp")
    )
    state = put_at_random(ours)
    draw, warp = (partial(_draw, worlds, state) for worlds in (ours, theirs))
    collect = _collecting()
    for work in (draw, warp, collect):  # compiles
        work()
    fps = dict[str, float]()
    fps["ours"], fps["warp"], over_warp = paired(draw, warp, seconds, rounds)
    fps["collecting"], _, collecting = paired(collect, warp, seconds, rounds)
    over_opengl = None
    if has_opengl:
        opengl = _opengl(ours, state)
        _, fps["opengl"], over_opengl = paired(draw, opengl, seconds, rounds)
    return {
        "world_over_warp": over_warp,
        "world_over_opengl": over_opengl,
        "world_collecting_over_warp": collecting,
        "world_fps": fps,
    }


def _draw(worlds: Worlds, state: State) -> int:
    return len(worlds.render(state))


def _collecting() -> Callable[[], int]:
    """Return a function that collects a batch as trainings of `experiment=reach` do."""
    settings = TrainSettings(
        task=reach(),
        camera=CAMERA,
        transforms=(Gray(), Standardize()),
        returns=Gae(),
        objective=Ppo(num_steps=64),
        collector=Rollouts(num_envs=PLACES),
    )
    collector = make_collector(settings).collector
    return lambda: next(iter(collector)).numel()


def _opengl(worlds: Worlds, state: State) -> Callable[[], int]:
    """Return a function that draws all places, one after the other."""
    model = worlds.scene.model
    model.vis.quality.offsamples = 0
    data, option = mujoco.MjData(model), mujoco.MjvOption()
    renderer = mujoco.Renderer(model, CAMERA.height, CAMERA.width)
    option.geomgroup[1] = False  # the drone's own body
    joint = model.joint("drone/").qposadr[0]
    poses = torch.cat([state.body.position, state.body.attitude], -1).double().numpy()

    def draw() -> int:
        for pose in poses:
            data.qpos[joint : joint + 7] = pose
            mujoco.mj_kinematics(model, data)
            mujoco.mj_camlight(model, data)
            renderer.update_scene(data, "drone/front_center", option)
            for flag in _PLAIN:
                renderer.scene.flags[getattr(mujoco.mjtRndFlag, f"mjRND_{flag}")] = False
            renderer.render()
        return len(poses)

    return draw


if __name__ == "__main__":
    found = measure(float(sys.argv[1]), int(sys.argv[2]), sys.argv[3] == "egl")
    sys.stdout.write(json.dumps(found) + "\n")
