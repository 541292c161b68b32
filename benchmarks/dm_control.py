# pyright: reportOptionalMemberAccess=false, reportAttributeAccessIssue=false
# pyright: reportArgumentType=false
# (dm_control's XML models are untyped.)
"""Speed of dm_control's pixel observations: one environment, rendered with OpenGL.

Run as a program (`python -m benchmarks.dm_control QUALITY SECONDS`) with MUJOCO_GL=egl, because
dm_control chooses OpenGL's platform when it is imported.
"""

import json
import sys
import time
from collections.abc import Callable

import numpy as np
from dm_control import composer
from dm_control.mujoco import engine

from drone_rl.sim.composer_task import ComposerTask
from drone_rl.sim.entities import hide_drone

_PLAIN = dict.fromkeys(("shadow", "reflection", "skybox", "fog", "haze"), False)


def default_rate(seconds: float) -> float:
    """Return the steps per second with pixel observations at MuJoCo's default quality.

    The shadow map has 4096 texels and each pixel 4 samples, as in a dm_control scene with default
    quality settings.
    """
    task = ComposerTask()
    root = task.root_entity.mjcf_model
    root.find("light", "sun").castshadow = True
    del root.visual.quality.shadowsize
    env = _environment(task)
    return _rate(env, lambda: None, seconds)


def tuned_rate(seconds: float) -> float:
    """Return the steps per second with pixel observations and all slow options turned off.

    There are no shadows, one sample for each pixel, no scene flags, and one camera for all frames
    instead of a new one for each frame.
    """
    task = ComposerTask(pixels=False)
    root = task.root_entity.mjcf_model
    root.visual.quality.set_attributes(offsamples=0, shadowsize=0)
    env = _environment(task)
    env.reset()
    height, width = task.camera.height, task.camera.width
    camera = engine.Camera(env.physics, height=height, width=width, camera_id="drone/front_center")
    option = hide_drone()
    return _rate(
        env,
        lambda: camera.render(scene_option=option, render_flag_overrides=_PLAIN),
        seconds,
    )


def _environment(task: ComposerTask) -> composer.Environment:
    return composer.Environment(
        task,
        random_state=0,
        strip_singleton_obs_buffer_dim=True,
        recompile_mjcf_every_episode=False,
    )


def _rate(env: composer.Environment, render: Callable[[], object], seconds: float) -> float:
    actions = np.random.RandomState(0)
    timestep = env.reset()
    env.step(0)
    render()
    frames, begin = 0, time.perf_counter()
    while time.perf_counter() - begin < seconds:
        timestep = env.reset() if timestep.last() else env.step(actions.randint(3))
        render()
        frames += 1
    return frames / (time.perf_counter() - begin)


if __name__ == "__main__":
    quality, seconds = sys.argv[1], float(sys.argv[2])
    rate = default_rate(seconds) if quality == "default" else tuned_rate(seconds)
    sys.stdout.write(json.dumps({"frames_per_second": rate}) + "\n")
