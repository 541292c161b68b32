"""Run a policy as an ONNX model: onnxruntime maps images to actions.

drone-rl export policy=good format=onnx hydra.run.dir=exported
python examples/run_onnx.py exported/policy.onnx      # prints 3.0 (three cubes) ten times
"""

import json
import sys

import onnxruntime
import torch

from drone_rl.envs import DroneEnv
from drone_rl.policies.zoo import PolicyDescription


def fly(path: str, episodes: int = 10, seed: int = 0) -> list[float]:
    """Return the reward of each episode of the greedy policy."""
    session = onnxruntime.InferenceSession(path)
    metadata = session.get_modelmeta().custom_metadata_map
    read = {key: json.loads(text) for key, text in metadata.items()}
    description = PolicyDescription.read(read["description"])
    task, camera = description.task.parameters, description.camera
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
