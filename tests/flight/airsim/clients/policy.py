"""Flies episodes by the actions that it reads, one for each image; prints what was collected.

Arguments: module, port, episodes, most actions an episode. Images are lines of base64.
"""

import base64
import importlib
import json
import math
import sys

airsim = importlib.import_module(sys.argv[1])
client = airsim.MultirotorClient(port=int(sys.argv[2]))
episodes, most = map(int, sys.argv[3:])
ALTITUDE = -2.5
VELOCITIES = ((1, 0), (0, -1), (0, 1))  # forward, left, right


def act():
    (image,) = client.simGetImages([airsim.ImageRequest("0", airsim.ImageType.Scene, False, False)])
    print(base64.b64encode(bytes(image.image_data_uint8)).decode(), flush=True)
    return int(sys.stdin.readline())


def standing():
    poses = (client.simGetObjectPose(f"cube_{i}") for i in range(3))
    return [not math.isnan(pose.position.x_val) for pose in poses]


found = []
for _ in range(episodes):
    client.reset()
    client.enableApiControl(True)
    client.armDisarm(True)
    client.takeoffAsync().join()
    client.moveToZAsync(ALTITUDE, 1).join()
    for _ in range(most):
        vx, vy = VELOCITIES[act()]
        client.moveByVelocityZAsync(vx, vy, ALTITUDE, 1).join()
        if not any(standing()):
            break
    found.append([not stands for stands in standing()])
print(json.dumps(found))
