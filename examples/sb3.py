"""Trains Stable-Baselines3's PPO on our worlds with our network, and flies it in unseen ones.

python examples/sb3.py     # 80,000 frames: half a minute on two cores
"""

import gymnasium
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecMonitor

import drone_rl
from drone_rl.config.transforms import Gray, Standardize

SEES = (Gray(), Standardize())
"""What becomes of the camera's frame, RGB bytes, before the network gets it."""


def train(frames: int = 80_000, *, num_envs: int = 64, steps: int = 64, seed: int = 0) -> PPO:
    """Trains on many worlds at once.

    Args:
        frames: Of all worlds together.
        num_envs: Worlds.
        steps: Of each world between two updates.
        seed: Of worlds, weights and actions.
    """
    name = "drone_rl/CollectCubes-v0"
    worlds = gymnasium.make_vec(name, num_envs=num_envs, autoreset_mode="SameStep")
    network = {"features_extractor_class": drone_rl.Sb3Trunk, "net_arch": []}
    how = {"n_steps": steps, "n_epochs": 4, "batch_size": 512, "learning_rate": 1e-3}
    env = VecMonitor(drone_rl.Sb3Worlds(worlds, SEES))
    model = PPO("CnnPolicy", env, ent_coef=0.01, policy_kwargs=network, seed=seed, **how)
    model.learn(frames)
    env.close()
    return model


def success(model: PPO, episodes: int = 200) -> float:
    """The share of unseen episodes in which it collects every cube, greedily."""
    policy = drone_rl.policy_from(drone_rl.Sb3Logits(model), transforms=SEES)
    return drone_rl.evaluate(policy, episodes=episodes, baselines=False).success


if __name__ == "__main__":
    print(f"every cube in {success(train()):.1%} of unseen episodes")
