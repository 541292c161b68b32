"""Methods that report which objects a camera shows, and where in its image."""

import dataclasses
import fnmatch
from collections.abc import Iterator, Sequence
from typing import Any

import torch

from drone_rl.flight.airsim import messages
from drone_rl.flight.airsim.messages import MAX_NAME, Map, number, text, to_world
from drone_rl.flight.airsim.methods.cameras import camera_at, put_camera
from drone_rl.flight.airsim.methods.registry import method, sim_vehicle_at
from drone_rl.flight.airsim.simulation import Simulation
from drone_rl.flight.airsim.vehicle import Vehicle
from drone_rl.flight.image_types import ImageType
from drone_rl.sim.coordinates import body_from_world, geo_from_world, inverse
from drone_rl.sim.rendering.appearance import product
from drone_rl.utils.errors import InputError

MAX_PATTERNS = 20
"""Most patterns of one camera."""


@method("simAddDetectionFilterMeshName", least=3)
def _add_pattern(simulation: Simulation, args: Sequence[Any]) -> None:
    camera, pattern = camera_at(simulation, args, 3), text(args[2], "mesh_name", MAX_NAME)
    if len(camera.detected) >= MAX_PATTERNS:
        raise InputError(
            f"a camera can have {MAX_PATTERNS} mesh names; call simClearDetectionMeshNames"
        )
    detected = (*camera.detected, pattern)
    put_camera(simulation, args, dataclasses.replace(camera, detected=detected), 3)


@method("simSetDetectionFilterRadius", least=3)
def _set_radius(simulation: Simulation, args: Sequence[Any]) -> None:
    radius = number(args[2], "radius_cm", 0.0, 1e9) / 100.0
    camera = dataclasses.replace(camera_at(simulation, args, 3), detection_radius=radius)
    put_camera(simulation, args, camera, 3)


@method("simClearDetectionMeshNames", least=2)
def _clear_patterns(simulation: Simulation, args: Sequence[Any]) -> None:
    camera = dataclasses.replace(camera_at(simulation, args, 2), detected=())
    put_camera(simulation, args, camera, 2)


@method("simGetDetections", least=2)
def _detections(simulation: Simulation, args: Sequence[Any]) -> list[Map]:
    return [*_found(simulation, args)]


def _found(simulation: Simulation, args: Sequence[Any]) -> Iterator[Map]:
    camera, vehicle = camera_at(simulation, args, 2), sim_vehicle_at(simulation, args, 2)
    stage = simulation.stage
    names = [n for n in stage.names if any(fnmatch.fnmatch(n, p) for p in camera.detected)]
    if not names:
        return
    (shot,) = stage.render(vehicle.body, camera, [ImageType.SEGMENTATION])
    attitude = product(vehicle.body.attitude[0].double(), camera.attitude)
    for name in names:
        box, pose = stage.box(shot, name), stage.object_pose(name)
        place = torch.tensor(to_world(pose.position), dtype=torch.float64)
        from_camera = body_from_world(attitude, place - vehicle.place_of(camera))
        if box is not None and float(from_camera.norm()) <= camera.detection_radius:
            turn = product(inverse(attitude), messages.attitude_to_world(pose.attitude)[0])
            w, i, j, k = messages.ned_attitude(turn[None])
            x, y, z = messages.ned(from_camera[None])
            relative = messages.Pose((x, y, z), (w, i, j, k))
            yield _detection(vehicle, name, place, relative, box, stage.radius(name))


def _detection(
    vehicle: Vehicle,
    name: str,
    place: torch.Tensor,
    relative: messages.Pose,
    box: Sequence[int],
    radius: float,
) -> Map:
    left, top, right, bottom = box
    ends = [[value + side for value in relative.position] for side in (-radius, radius)]
    return {
        "name": name,
        "geo_point": messages.geo_point(geo_from_world(place, vehicle.geo_home).tolist()),
        "box2D": {
            "min": {"x_val": float(left), "y_val": float(top)},
            "max": {"x_val": float(right), "y_val": float(bottom)},
        },
        "box3D": {"min": messages.vector(ends[0]), "max": messages.vector(ends[1])},
        "relative_pose": messages.pose(relative),
    }
