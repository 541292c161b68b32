"""Flies a policy that is an ONNX model: pictures go to onnxruntime, and actions come back.

drone-rl export policy=good format=onnx hydra.run.dir=exported
python examples/run_onnx.py exported/policy.onnx      # three cubes in each of ten episodes
"""

import json
import sys

import onnxruntime
import torch

from drone_rl import CameraSettings, TaskSettings
from drone_rl.envs import DroneEnv


def fly(path: str, episodes: int = 10, seed: int = 0) -> list[float]:
    """The reward of each episode, flown by the most probable actions."""
    session = onnxruntime.InferenceSession(path)
    about = session.get_modelmeta().custom_metadata_map
    told = {key: json.loads(text) for key, text in about.items()}
    task = TaskSettings.read(told["task"], "task")
    camera = CameraSettings.read(told["camera"], "camera")
    env, rewards = DroneEnv(1, task, camera, seed=seed), []
    for _ in range(episodes):
        state, reward = env.reset(), 0.0
        while not state["done"].all():
            (probabilities,) = session.run(None, {"frames": state["pixels"].numpy()})
            action = torch.from_numpy(probabilities.argmax(-1))
            state = env.step(state.set("action", action))["next"]
            reward += state["reward"].item()
        rewards.append(reward)
    env.close()
    return rewards


if __name__ == "__main__":
    print(*fly(sys.argv[1]))
