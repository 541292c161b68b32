"""Flies as the documentation of AirSim's client does; prints what it found as JSON."""

import importlib
import json
import math
import sys

airsim = importlib.import_module(sys.argv[1])
client = airsim.MultirotorClient(port=int(sys.argv[2]))
client.confirmConnection()
client.enableApiControl(True)
found = {"armed": client.armDisarm(True), "takeoff": client.takeoffAsync().join()}
state = client.getMultirotorState()
found["landed"] = state.landed_state
found["height"] = state.kinematics_estimated.position.z_val

# a square
corners = [(5, 0), (5, 5), (0, 5), (0, 0)]
found["corners"] = []
for x, y in corners:
    client.moveToPositionAsync(x, y, -3, 3).join()
    position = client.simGetVehiclePose().position
    found["corners"].append(math.hypot(position.x_val - x, position.y_val - y))

# a path, facing the way
path = [airsim.Vector3r(x, y, -3) for x, y in ((4, 0), (8, 2), (12, 0))]
drivetrain = airsim.DrivetrainType.ForwardOnly
client.moveOnPathAsync(path, 3, 60, drivetrain, airsim.YawMode(False, 0)).join()
found["path"] = client.simGetVehiclePose().position.x_val

# an orbit with commands that are sent again before they end
center, radius = (6.0, 0.0), 6.0
for _ in range(40):
    position = client.simGetVehiclePose().position
    angle = math.atan2(position.y_val - center[1], position.x_val - center[0])
    missing = radius - math.hypot(position.x_val - center[0], position.y_val - center[1])
    vx = -2.0 * math.sin(angle) + missing * math.cos(angle)
    vy = 2.0 * math.cos(angle) + missing * math.sin(angle)
    last = client.moveByVelocityZAsync(vx, vy, -3, 1)
    client.simContinueForTime(0.2)
    client.simPause(False)
position = client.simGetVehiclePose().position
found["orbit"] = math.hypot(position.x_val - center[0], position.y_val - center[1])
last.join()

# what sensors and cameras say
found["imu"] = client.getImuData().linear_acceleration.z_val
found["gps"] = client.getGpsData().gnss.geo_point.latitude
found["barometer"] = client.getBarometerData().altitude
client.getMagnetometerData()
request = airsim.ImageRequest
depth = getattr(airsim.ImageType, "DepthPlanar", 1)
images = client.simGetImages(
    [
        request("0", airsim.ImageType.Scene, False, False),
        request("0", airsim.ImageType.Scene),
        request("3", depth, True, False),
    ]
)
found["raw"] = len(images[0].image_data_uint8)
found["png"] = images[1].image_data_uint8[:4].hex()
found["floats"] = len(images[2].image_data_float)
found["below"] = images[2].image_data_float[len(images[2].image_data_float) // 2]

found["home"] = client.goHomeAsync().join()
found["landed_again"] = client.getMultirotorState().landed_state
client.armDisarm(False)
client.enableApiControl(False)
client.reset()
found["after_reset"] = [*vars(client.simGetVehiclePose().position).values()]
try:
    client.simGetObjectPose("tree")
    client.getLidarData()
except Exception as error:
    found["refused"] = str(error)
print(json.dumps(found))
