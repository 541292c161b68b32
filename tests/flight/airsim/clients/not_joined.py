"""Sends a movement and sleeps; then uses what airsim 1.8.1 needs numpy 1 for."""

import importlib
import json
import sys
import time
from importlib import metadata

import numpy as np

if any(one.metadata["Name"] == "rpc-msgpack" for one in metadata.distributions()):
    import airsim_fixes

airsim = importlib.import_module(sys.argv[1])
client = airsim.MultirotorClient(port=int(sys.argv[2]))
client.enableApiControl(True)
client.takeoffAsync().join()
client.moveByVelocityAsync(2, 0, 0, 60)
time.sleep(2)
found = {"moved": client.simGetVehiclePose().position.x_val}

if not any(one.metadata["Name"] == "rpc-msgpack" for one in metadata.distributions()):
    import airsim_fixes  # noqa: F401

vector = airsim.Vector3r(1.0, 2.0, 3.0) * 2.0
found["twice"] = [vector.x_val, vector.y_val, vector.z_val]
request = airsim.ImageRequest("0", airsim.ImageType.Scene, False, False)
(image,) = client.simGetImages([request])
found["numbers"] = np.fromstring("1 2 3", sep=" ").tolist()
found["bytes"] = len(airsim.string_to_uint8_array(image.image_data_uint8))
print(json.dumps(found))
