"""A Gymnasium-like environment around AirSim's client, as its reinforcement learning examples."""

import importlib
import json
import sys

import numpy as np

airsim = importlib.import_module(sys.argv[1])
client = airsim.MultirotorClient(port=int(sys.argv[2]))


def observe():
    response = client.simGetImages(
        [airsim.ImageRequest("0", airsim.ImageType.Scene, False, False)]
    )[0]
    image = np.frombuffer(response.image_data_uint8, np.uint8)
    return image.reshape(response.height, response.width, 3)


def reset():
    client.reset()
    client.enableApiControl(True)
    client.armDisarm(True)
    client.takeoffAsync().join()
    return observe()


def step(action):
    vx, vy = ((1, 0), (0, -1), (0, 1))[action]
    client.moveByVelocityZAsync(vx, vy, -2, 0.25).join()
    state = client.getMultirotorState()
    collided = client.simGetCollisionInfo().has_collided
    return observe(), state.kinematics_estimated.position.x_val, collided


image, rewards, steps = reset(), [], int(sys.argv[3])
random = np.random.RandomState(0)
shapes = set()
for _ in range(steps):
    image, x, _ = step(random.randint(3))
    rewards.append(x)
    shapes.add(image.shape)
print(json.dumps({"steps": len(rewards), "shapes": [list(s) for s in shapes], "x": rewards[-1]}))
