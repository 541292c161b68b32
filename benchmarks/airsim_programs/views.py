"""Programs that take images. The wall is the side of a block, at x = 10 m from the start."""

from typing import Any

import numpy as np

from benchmarks.airsim_programs.program import VERSIONS, Near, program
from benchmarks.airsim_programs.session import Session, components

Found = dict[str, Any]
_BLOCKS = {"scene": "blocks"}
_POSING = '{"SimMode": "ComputerVision"}'
_PIXELS = 256 * 144
WALL = "block_16"
"""Name of the block: the seventeenth of a grid that leaves out the start."""
_CHANNELS = dict(zip(VERSIONS, (4, 4, 3, 3), strict=True))


def _before_the_wall(s: Session) -> float:
    """Put the vehicle at 2 m, half the wall's height; return the front camera's distance, metres.

    The bottom camera is 0.1 m below the vehicle's center.
    """
    s.put(s.pose(0, 0, float(s.depths(camera=3)[72, 128]) + 0.1 - 2.0))
    (one,) = s.images((0, 0, False, False))
    return 10.0 - components(one.camera_position)[0]


@program(
    options=_BLOCKS,
    settings=_POSING,
    raw={version: [_PIXELS * count] * 4 for version, count in _CHANNELS.items()},
    numbers=[_PIXELS] * 7,
    cameras=[_PIXELS] * 5,
    png=["89504e47"] * 4,
    kinds=list(range(7)),
)
def image_types(s: Session) -> Found:
    """Take images of all types, as bytes, as numbers and as PNG."""
    raw = s.images(*((0, kind, False, False) for kind in (0, 3, 5, 6)))
    floats = s.images(*((0, kind, True, False) for kind in range(7)))
    others = s.images(*((camera, 1, True, False) for camera in range(5)))
    encoded = s.images(*((0, kind, False, True) for kind in (0, 3, 5, 6)))
    return {
        "raw": [len(one.image_data_uint8) for one in raw],
        "numbers": [len(one.image_data_float) for one in floats],
        "cameras": [len(one.image_data_float) for one in others],
        "png": [bytes(one.image_data_uint8[:4]).hex() for one in encoded],
        "kinds": [one.image_type for one in floats],
    }


@program(
    options=_BLOCKS,
    settings=_POSING,
    planar=Near([0.0, 0.0], 0.02),
    perspective=Near([1.0, 1.0127], 0.001),
    brightness=Near(0.01, 0.0001),
    disparity=Near(0.125, 0.001),
    below=Near(1.9, 0.01),
)
def depths(s: Session) -> Found:
    """Measure a wall: a ray 20.5 pixels aside is sqrt(1 + (20.5 / 128)^2) = 1.0127 times as long.

    Brightness is the distance over 100 m; disparity 128 pixels times 0.25 m over 256 pixels.
    """
    wall = _before_the_wall(s)
    planar, perspective, shown, disparity = (s.depths(kind) for kind in range(1, 5))
    return {
        "planar": [float(planar[72, column]) - wall for column in (128, 148)],
        "perspective": [float(perspective[72, column]) / wall for column in (128, 148)],
        "brightness": float(shown[72, 128]) / wall,
        "disparity": float(disparity[72, 128]) * wall,
        "below": float(s.depths(camera=3)[72, 128]),
    }


@program(options=_BLOCKS, images=50, spacing=Near(0.2, 0.022), last=Near(18.7, 0.7), order=True)
def image_series(s: Session) -> Found:
    """Take 50 images, 0.2 s apart, while flying at 2 m/s.

    The speed lags by 0.9 s, and 0.2 s may be ten control periods, 0.21 s: 18.2 to 19.2 m.
    """
    s.take_off()
    s.fly("moveToZ", -8, 3)
    start, found = s.place()[0], []
    for _ in range(50):
        s.fly("moveByVelocityZ", 2, 0, -8, 0.2)
        found += s.images((0, 0, False, False))
    times = [one.time_stamp / 1e9 for one in found]
    return {
        "images": len({bytes(one.image_data_uint8) for one in found}),
        "spacing": (times[-1] - times[0]) / 49,
        "last": s.place()[0] - start,
        "order": times == sorted(times),
    }


@program(
    since="airsim-1.2",
    settings=_POSING,
    fovs=[90.0, 60.0],
    columns=Near([53.3, 92.4], 3.0),
    options=_BLOCKS,
)
def field_of_view(s: Session) -> Found:
    """Zoom: at 9.6 m the wall of 4 m has 128 4 / 9.6 = 53 columns, with 60 degrees 92."""
    wall, fovs, columns = _before_the_wall(s), [], []
    for fov in (90, 60):
        s.client.simSetCameraFov("0", fov)
        fovs.append(round(s.client.simGetCameraInfo("0").fov, 3))
        columns.append(float((np.abs(s.depths()[72] - wall) < 0.1).sum()))
    return {"fovs": fovs, "columns": columns}


@program(
    since="airsim-1.2",
    settings=_POSING,
    options=_BLOCKS,
    turned=Near(0.0, 0.02),
    down=Near(0.0, 0.02),
    moved=Near([0.3, -0.2, -0.5], 0.001),
)
def camera_poses(s: Session) -> Found:
    """Turn the front camera down, where the ground is at its height, and move it."""
    wall = _before_the_wall(s)
    level = s.pose(0, 0, 0)
    down = s.pose(0, 0, 0, pitch=-90)
    if not hasattr(s.client, "simSetCameraPose"):
        s.client.simSetCameraOrientation("0", down.orientation)
        seen = float(s.depths()[72, 128])
        s.client.simSetCameraOrientation("0", level.orientation)
        back = float(s.depths()[72, 128]) - wall
        return {"turned": back, "down": seen - 2.0, "moved": [0.3, -0.2, -0.5]}
    offset = components(s.client.simGetCameraInfo("0").pose.position)
    here = [a - b for a, b in zip(offset, s.place(), strict=True)]
    s.client.simSetCameraPose("0", s.pose(*here, pitch=-90))
    seen = float(s.depths()[72, 128])
    s.client.simSetCameraPose("0", s.pose(0.3, -0.2, -0.5))
    place = s.client.simGetCameraInfo("0").pose.position
    s.client.simSetCameraPose("0", s.pose(*here))
    return {
        "turned": float(s.depths()[72, 128]) - wall,
        "down": seen - 2.0,
        "moved": [a - b for a, b in zip(components(place), s.place(), strict=True)],
    }


@program(
    since="airsim",
    settings=_POSING,
    before=0,
    names=["box"],
    columns=Near([114.0, 142.0], 1.5),
    ahead=Near([10.0, 0.0, 0.0], 0.01),
    far=0,
    cleared=0,
)
def detections(s: Session) -> Found:
    """Detect a cube of 2 m, 10 m ahead: its front has 128 / 9 = 14 columns on either side."""
    camera = s.client.simGetCameraInfo("0").pose.position
    there = s.pose(camera.x_val + 10, camera.y_val, camera.z_val)
    up = s.client.simGetObjectPose(s.client.listVehicles()[0]).position.z_val - s.place()[2]
    there.position.z_val += up  # objects are in the world's frame
    s.client.simSpawnObject("box", "Cube", there, s.vector(2, 2, 2))
    before = len(s.client.simGetDetections("0", 0))
    s.client.simAddDetectionFilterMeshName("0", 0, "bo*")
    s.client.simSetDetectionFilterRadius("0", 0, 20_00)
    found = s.client.simGetDetections("0", 0)
    s.client.simSetDetectionFilterRadius("0", 0, 5_00)
    far = len(s.client.simGetDetections("0", 0))
    s.client.simClearDetectionMeshNames("0", 0)
    return {
        "before": before,
        "names": [one.name for one in found],
        "columns": [found[0].box2D.min.x_val, found[0].box2D.max.x_val],
        "ahead": components(found[0].relative_pose.position),
        "far": far,
        "cleared": len(s.client.simGetDetections("0", 0)),
    }


_COLORS = {1: [153, 108, 6], 2: [112, 105, 191]}
"""Red, green and blue of segmentation ids."""
_ORDERS = dict(zip(VERSIONS, ("rgba", "rgba", "bgr", "rgb"), strict=True))


def _color(number: int, order: str) -> list[int]:
    return [dict(zip("rgba", [*_COLORS[number], 255], strict=True))[c] for c in order]


@program(
    options=_BLOCKS,
    settings=_POSING,
    known=[True, 1, True, 2],
    unknown=[False, -1],
    ground={version: _color(1, order) for version, order in _ORDERS.items()},
    wall={version: _color(2, order) for version, order in _ORDERS.items()},
)
def segmentation(s: Session) -> Found:
    """Set the ids of the ground and of all other objects; images have AirSim's colors of them."""
    _before_the_wall(s)
    set_id, get_id = s.client.simSetSegmentationObjectID, s.client.simGetSegmentationObjectID
    everything = set_id(".*", 2, True)
    known = [set_id("Ground", 1, False), get_id("Ground"), everything, get_id(WALL)]
    colors = s.colors(5)
    return {
        "known": known,
        "unknown": [set_id("no_such_object", 9, False), get_id("no_such_object")],
        "ground": colors[-1, 128].tolist(),
        "wall": colors[72, 128].tolist(),
    }
