"""Judge and explain a policy that Stable-Baselines3 trained with its own CnnPolicy on RGB images.

python examples/judge_sb3.py               # train for a minute or two, then judge and explain
python examples/judge_sb3.py ppo.zip       # judge and explain a saved model
"""

import sys
from typing import Any

import gymnasium
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import EvalCallback, StopTrainingOnRewardThreshold
from stable_baselines3.common.vec_env import VecMonitor, VecTransposeImage

import drone_rl

CAMERA = drone_rl.CameraSettings(width=64, height=40)
"""CnnPolicy needs at least 36 pixels in each direction."""


def make_env(seed: int, num_envs: int) -> VecTransposeImage:
    """Return a batch of environments with RGB images, channels first."""
    name = "drone_rl/CollectCubes-v0"
    envs = gymnasium.make_vec(name, num_envs=num_envs, autoreset_mode="SameStep", camera=CAMERA)
    env = VecTransposeImage(VecMonitor(drone_rl.Sb3Worlds(envs)))
    env.seed(seed)
    return env


def train(frames: int = 200_000, *, num_envs: int = 32, steps: int = 128, seed: int = 0) -> PPO:
    """Train CnnPolicy on RGB images until its most probable actions collect every cube."""
    stop = StopTrainingOnRewardThreshold(2.99)
    other = make_env(1000 + seed, num_envs)
    until = EvalCallback(
        other, callback_on_new_best=stop, n_eval_episodes=200, eval_freq=steps, verbose=0
    )
    options = {"batch_size": 512, "n_epochs": 4, "learning_rate": 1e-3, "ent_coef": 0.01}
    model = PPO("CnnPolicy", make_env(seed, num_envs), n_steps=steps, seed=seed, **options)
    return model.learn(frames, callback=until)


def trust(model: PPO, folder: str = "outputs/explain/sb3", **settings: Any) -> None:
    """Print the verdict and write a report; `settings` are those of `drone_rl.ExplainSettings`."""
    policy = drone_rl.policy_from(model, name="PPO of SB3")
    print(drone_rl.judge(policy, episodes=settings.get("episodes", 400)))
    print(drone_rl.explain(policy, folder=folder, **settings).report)


if __name__ == "__main__":
    trust(PPO.load(sys.argv[1]) if len(sys.argv) > 1 else train())
