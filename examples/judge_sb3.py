"""Judge and explain a policy that Stable-Baselines3 trained with its own CnnPolicy on RGB images.

python examples/judge_sb3.py               # train for two minutes, then judge and explain
python examples/judge_sb3.py ppo.zip       # judge and explain a saved model
"""

import sys

import gymnasium
from stable_baselines3 import PPO

import drone_rl
from drone_rl.config.transforms import Rgb

CAMERA = drone_rl.CameraSettings(width=64, height=40)
"""CnnPolicy needs at least 36 pixels in each direction."""


def train(frames: int = 40_000, *, num_envs: int = 32, steps: int = 128, seed: int = 0) -> PPO:
    """Train CnnPolicy on RGB images."""
    envs = gymnasium.make_vec(
        "drone_rl/CollectCubes-v0", num_envs=num_envs, autoreset_mode="SameStep", camera=CAMERA
    )
    env = drone_rl.Sb3Worlds(envs)
    options = {"batch_size": 512, "n_epochs": 4, "learning_rate": 1e-3, "ent_coef": 0.01}
    model = PPO("CnnPolicy", env, n_steps=steps, seed=seed, **options)
    model.learn(frames)
    env.close()
    return model


def trust(model: PPO, folder: str = "outputs/explain/sb3", **settings: int) -> None:
    """Print the verdict and write a report.

    Args:
        model: A model whose observations are RGB images, uint8.
        folder: Folder of the report.
        settings: Settings of the explanation, see `drone_rl.ExplainSettings`.
    """
    logits = drone_rl.Sb3Logits(model)  # or any callable from images to logits
    policy = drone_rl.policy_from(logits, camera=CAMERA, transforms=[Rgb()], name="PPO of SB3")
    print(drone_rl.judge(policy, episodes=settings.get("episodes", 400)))
    print(drone_rl.explain(policy, folder=folder, **settings).report)


if __name__ == "__main__":
    trust(PPO.load(sys.argv[1]) if len(sys.argv) > 1 else train())
