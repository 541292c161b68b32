"""Teleports in computer-vision mode and takes images; prints what it found as JSON."""

import importlib
import json
import math
import sys

airsim = importlib.import_module(sys.argv[1])
client = airsim.VehicleClient(port=int(sys.argv[2]))
client.confirmConnection()
to_quaternion = getattr(airsim, "to_quaternion", None) or airsim.euler_to_quaternion
found = {"poses": [], "sizes": {}}
for step in range(5):
    turn = to_quaternion(0, 0, math.radians(30 * step))
    pose = airsim.Pose(airsim.Vector3r(step, -step, -2), turn)
    client.simSetVehiclePose(pose, True)
    now = client.simGetVehiclePose()
    found["poses"].append([now.position.x_val, now.position.y_val, now.orientation.z_val])
client.simSetVehiclePose(airsim.Pose(airsim.Vector3r(0, 0, 0), to_quaternion(0, 0, 0)), True)
for camera in ("0", "1", "2", "3", "4"):
    for kind in range(7):
        compress = kind in (0, 5, 6)
        (image,) = client.simGetImages([airsim.ImageRequest(camera, kind, not compress, compress)])
        found["sizes"][f"{camera}.{kind}"] = len(image.image_data_uint8) or len(
            image.image_data_float
        )
objects = client.simListSceneObjects("cube.*")
found["objects"] = objects
before = client.simGetObjectPose(objects[0])
moved = airsim.Pose(airsim.Vector3r(9, 1, -2.5), before.orientation)
found["moved"] = client.simSetObjectPose(objects[0], moved, True)
found["there"] = client.simGetObjectPose(objects[0]).position.x_val
client.simSetSegmentationObjectID("cube.*", 20, True)
found["id"] = client.simGetSegmentationObjectID(objects[0])
info = client.simGetCameraInfo("0")
found["fov"] = info.fov
client.simPause(True)
found["paused"] = client.simIsPause()
client.simPause(False)
print(json.dumps(found))
