"""Methods that report which objects a camera shows, and where in its image."""

import fnmatch
from collections.abc import Sequence

import torch

from drone_rl.flight.airsim import messages
from drone_rl.flight.airsim.messages import MAX_NAME, Map, Pose, number, text, to_world, whole
from drone_rl.flight.airsim.methods.cameras import CAMERA, change_camera
from drone_rl.flight.airsim.methods.registry import VEHICLE, given, method, vehicle_method
from drone_rl.flight.airsim.simulation import Simulation
from drone_rl.flight.airsim.vehicle import Vehicle
from drone_rl.flight.image_types import ImageType
from drone_rl.sim.coordinates import body_from_world, geo_from_world, inverse
from drone_rl.sim.rendering.appearance import product
from drone_rl.utils.errors import InputError

MAX_PATTERNS = 20
"""Most patterns of one camera."""
_OF_TYPE = (CAMERA, given(whole, "image_type", 0, 10))
"""A camera, and an image type, which does not matter."""


@vehicle_method("simAddDetectionFilterMeshName", *_OF_TYPE, given(text, "mesh_name", MAX_NAME))
def _add_pattern(vehicle: Vehicle, camera: str, kind: int, pattern: str) -> None:
    patterns = vehicle.cameras[camera].detected
    if len(patterns) >= MAX_PATTERNS:
        raise InputError(
            f"a camera can have {MAX_PATTERNS} mesh names; call simClearDetectionMeshNames"
        )
    change_camera(vehicle, camera, {"detected": (*patterns, pattern)})


@vehicle_method("simSetDetectionFilterRadius", *_OF_TYPE, given(number, "radius_cm", 0.0, 1e9))
def _set_radius(vehicle: Vehicle, camera: str, kind: int, radius: float) -> None:
    change_camera(vehicle, camera, {"detection_radius": radius / 100.0})


@vehicle_method("simClearDetectionMeshNames", *_OF_TYPE)
def _clear_patterns(vehicle: Vehicle, camera: str, kind: int) -> None:
    change_camera(vehicle, camera, {"detected": ()})


@method("simGetDetections", *_OF_TYPE, VEHICLE)
def _detections(simulation: Simulation, name: str, kind: int, vehicle: Vehicle) -> list[Map]:
    stage, camera, detections = simulation.stage, vehicle.cameras[name], []
    names = [n for n in stage.names if any(fnmatch.fnmatch(n, p) for p in camera.detected)]
    if not names:
        return []
    (shot,) = stage.render(vehicle.body, camera, [ImageType.SEGMENTATION])
    attitude = product(vehicle.body.attitude[0].double(), camera.attitude)
    for one in names:
        box, pose = stage.box(shot, one), stage.object_pose(one)
        place = torch.tensor(to_world(pose.position), dtype=torch.float64)
        from_camera = body_from_world(attitude, place - vehicle.place_of(camera))
        if box is not None and float(from_camera.norm()) <= camera.detection_radius:
            turn = product(inverse(attitude), messages.attitude_to_world(pose.attitude))
            relative = Pose.of(from_camera, turn)
            geo_point = geo_from_world(place, vehicle.geo_home).tolist()
            detections.append({"name": one, "geo_point": messages.geo_point(geo_point)})
            detections[-1].update(_boxes(relative, box, stage.radius(one)))
    return detections


def _boxes(relative: Pose, box: Sequence[int], radius: float) -> Map:
    left, top, right, bottom = map(float, box)
    ends = [[value + side for value in relative.position] for side in (-radius, radius)]
    return {
        "box2D": {
            "min": {"x_val": left, "y_val": top},
            "max": {"x_val": right, "y_val": bottom},
        },
        "box3D": {"min": messages.vector(ends[0]), "max": messages.vector(ends[1])},
        "relative_pose": messages.pose(relative),
    }
