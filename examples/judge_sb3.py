"""Can a policy be trusted that Stable-Baselines3 trained by itself, on colours and its own network?

python examples/judge_sb3.py               # trains for two minutes, then judges and explains
python examples/judge_sb3.py ppo.zip       # judges and explains a model that it saved
"""

import sys

import gymnasium
from stable_baselines3 import PPO

import drone_rl
from drone_rl.config.transforms import Rgb

CAMERA = drone_rl.CameraSettings(width=64, height=40)
"""At least 36 pixels each way, which their CnnPolicy needs."""


def train(frames: int = 40_000, *, num_envs: int = 32, steps: int = 128, seed: int = 0) -> PPO:
    """Trains their CnnPolicy on the camera's frames as they are."""
    worlds = gymnasium.make_vec(
        "drone_rl/CollectCubes-v0", num_envs=num_envs, autoreset_mode="SameStep", camera=CAMERA
    )
    env = drone_rl.Sb3Worlds(worlds)
    how = {"batch_size": 512, "n_epochs": 4, "learning_rate": 1e-3, "ent_coef": 0.01}
    model = PPO("CnnPolicy", env, n_steps=steps, seed=seed, **how)
    model.learn(frames)
    env.close()
    return model


def trust(model: PPO, folder: str = "outputs/explain/sb3", **settings: int) -> None:
    """Prints the verdict, and leaves a report of what it sees.

    Args:
        model: With a policy that sees the camera's frames, RGB bytes.
        folder: Of the report.
        settings: Of the explanation, see `drone_rl.ExplainSettings`.
    """
    logits = drone_rl.Sb3Logits(model)  # or any callable from pictures to logits
    policy = drone_rl.policy_from(logits, camera=CAMERA, transforms=[Rgb()], name="PPO of SB3")
    print(drone_rl.judge(policy, episodes=settings.get("episodes", 400)))
    print(drone_rl.explain(policy, folder=folder, **settings).report)


if __name__ == "__main__":
    trust(PPO.load(sys.argv[1]) if len(sys.argv) > 1 else train())
