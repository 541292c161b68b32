"""Train Stable-Baselines3's PPO with drone_rl's network and evaluate it in unseen environments.

python examples/sb3.py     # 80,000 frames: half a minute on two cores
"""

import gymnasium
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecMonitor

import drone_rl
from drone_rl.config.transforms import Gray, Standardize

TRANSFORMS = (Gray(), Standardize())
"""From RGB images, uint8, to the observations of the network."""


def train(frames: int = 80_000, *, num_envs: int = 64, steps: int = 64, seed: int = 0) -> PPO:
    """Train in a batch of environments.

    Args:
        frames: Total steps of all environments.
        num_envs: Number of environments.
        steps: Steps of each environment between two updates.
        seed: Seed of environments, weights and actions.
    """
    name = "drone_rl/CollectCubes-v0"
    how = {"autoreset_mode": "SameStep", "transforms": TRANSFORMS}
    envs = gymnasium.make_vec(name, num_envs=num_envs, **how)
    network = {"features_extractor_class": drone_rl.Sb3Trunk, "net_arch": []}
    options = {"n_steps": steps, "n_epochs": 4, "batch_size": 512, "learning_rate": 1e-3}
    env = VecMonitor(drone_rl.Sb3Worlds(envs))
    model = PPO("CnnPolicy", env, ent_coef=0.01, policy_kwargs=network, seed=seed, **options)
    model.learn(frames)
    env.close()
    return model


def success(model: PPO, episodes: int = 200) -> float:
    """Return the success rate of the greedy policy in unseen episodes."""
    return drone_rl.evaluate(model, episodes=episodes, baselines=False).success


if __name__ == "__main__":
    print(f"every cube in {success(train()):.1%} of unseen episodes")
