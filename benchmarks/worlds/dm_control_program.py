"""Act at random in a scene through dm_control."""

import json
import sys

import numpy as np

from drone_rl.config import BaseTaskSettings
from drone_rl.sim.composer_task import make_environment

task = BaseTaskSettings.read({"name": "reach", "scene": sys.argv[1]}, "task")
env = make_environment(task.replace(step_limit=60), pixels=False)
random = np.random.RandomState(0)
timestep, episodes = env.reset(), 0
for _ in range(100):
    if timestep.last():
        timestep, episodes = env.reset(), episodes + 1
    else:
        timestep = env.step(random.randint(3))
sys.stdout.write(json.dumps({"episodes": episodes}))
