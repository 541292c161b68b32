"""Training works, more slowly, without the package `drone_rl.acceleration`."""

from tests.forked import run_forked

PROGRAM = """
import logging, sys
sys.modules["drone_rl.acceleration"] = None  # any import of it fails
logging.basicConfig(level=logging.INFO, format="%(message)s", stream=sys.stdout, force=True)
import drone_rl
from drone_rl.config.learning import Ppo, Rollouts
from drone_rl.config.training import TrainerSettings
from drone_rl.utils.progress import silent

settings = drone_rl.TrainSettings(
    task=drone_rl.TaskSettings(num_cubes=1, first_distance=3.0, step_limit=5),
    trainer=TrainerSettings(total_frames=100, confirm_episodes=4, target_share=0.01),
)
for changes in ({}, {"objective": Ppo(num_steps=5), "collector": Rollouts(num_envs=4)}):
    done = drone_rl.train(settings.replace(**changes), folder=sys.argv[1], progress=silent)
    print("frames", done.result["frames"])
    sys.argv[1] += "2"
assert not any(name.startswith("drone_rl.acceleration.") for name in sys.modules)
"""


def test_every_objective_trains_without_the_acceleration(tmp_path):
    done = run_forked(PROGRAM, "run", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    log = "stepping collector: drone_rl.acceleration is not installed"
    assert done.stdout.count(log) == 2
    assert done.stdout.count("frames ") == 2
