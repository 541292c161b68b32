"""Programs about collisions, objects, weather and recordings."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.airsim_programs.program import VERSIONS, Near, program
from benchmarks.airsim_programs.session import Session, components
from benchmarks.airsim_programs.views import WALL

Found = dict[str, Any]
_BLOCKS = {"scene": "blocks"}
_CUBES = {"scene": "cubes"}
_POSING = '{"SimMode": "ComputerVision"}'
_RADIUS = 0.3
"""Of the vehicle, metres."""


@program(
    options=_BLOCKS,
    name=WALL,
    point=Near(10.0, 0.05),
    normal=Near([-1.0, 0.0, 0.0], 0.01),
    position=Near(9.7, 0.05),
)
def wall(s: Session) -> Found:
    """Fly into a wall that is 10 m away."""
    s.take_off()
    s.collision()
    s.fly("moveByVelocityZ", 3, 0, -2, 5)
    found = s.collision()
    return {
        "name": _text(found.object_name),
        "point": components(found.impact_point)[0],
        "normal": components(found.normal),
        "position": components(found.position)[0],
    }


def _text(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else value


@program(since="airsim-1.2", options=_BLOCKS, collisions=[False, True, False, False])
def collisions_are_read_once(s: Session) -> Found:
    """Read the collision before a wall, after it, again, and 2 s later."""
    s.take_off()
    s.collision()
    s.fly("moveToPosition", 7, 0, -2, 3)
    found = [s.collision().has_collided]
    s.fly("moveByVelocityZ", 3, 0, -2, 2)
    s.fly("moveByVelocityZ", -3, 0, -2, 1)
    found += [s.collision().has_collided, s.collision().has_collided]
    s.fly("hover")
    s.fly("moveByVelocityZ", 0, 0, -2, 2)
    return {"collisions": [*found, s.collision().has_collided]}


@program(since="airsim-1.2", name="Ground", collisions=[True] + 10 * [False])
def ground(s: Session) -> Found:
    """Land: that is one collision, and standing there is none."""
    s.take_off()
    s.collision()
    s.fly("land")
    found = s.collision()
    collisions = [found.has_collided]
    for _ in range(10):
        s.client.simContinueForTime(0.1)
        collisions.append(s.collision().has_collided)
    return {"name": found.object_name, "collisions": collisions}


@program(until="AirSimClient", name="Ground", collisions=[False, True, True, False])
def ground_1_1(s: Session) -> Found:
    """Land and take off: version 1.1 reports contact while it lasts."""
    s.take_off()
    found = [s.collision().has_collided]
    s.fly("land")
    name = _text(s.collision().object_name)
    found += [s.collision().has_collided, s.collision().has_collided]
    s.fly("takeoff")
    return {"name": name, "collisions": [*found, s.collision().has_collided]}


@program(since="airsim-1.2", options=_CUBES, touched=True, name="cube_0", gone=True, again=3)
def cube(s: Session) -> Found:
    """Fly through a cube: it is reported by its name and vanishes; reset returns it."""
    s.take_off()
    there, here = s.client.simGetObjectPose("cube_0").position, s.place()
    up = s.client.simGetObjectPose(s.vehicle()).position.z_val - here[2]
    s.collision()
    s.fly("moveToPosition", there.x_val - 3, there.y_val, there.z_val - up, 3)
    s.fly("moveToPosition", there.x_val + 2, there.y_val, there.z_val - up, 2)
    found = s.collision()
    gone = math.isnan(s.client.simGetObjectPose("cube_0").position.x_val)
    s.client.reset()
    poses = [s.client.simGetObjectPose(f"cube_{i}").position.x_val for i in range(3)]
    return {
        "touched": found.has_collided,
        "name": found.object_name,
        "gone": gone,
        "again": sum(math.isfinite(x) for x in poses),
    }


@program(
    options=_BLOCKS,
    settings=_POSING,
    swept=Near(10 - _RADIUS, 0.06),
    collided=True,
    name=WALL,
    ignored=Near(20.0, 1e-3),
    facing=Near(30.0, 0.01),
)
def teleports(s: Session) -> Found:
    """Teleport into a block, which stops the vehicle unless it ignores collisions."""
    up = 2.0 - _height(s)
    s.put(s.pose(0, 0, -up), False)
    s.collision()
    s.put(s.pose(14, 0, -up), False)
    swept, found = s.place()[0], s.collision()
    s.put(s.pose(20, 0, -up, yaw=30), True)
    return {
        "swept": swept,
        "collided": found.has_collided,
        "name": _text(found.object_name),
        "ignored": s.place()[0],
        "facing": s.angles()[1],
    }


def _height(s: Session) -> float:
    """Height of the vehicle at its start: that of the bottom camera, 0.1 m below it, by depth."""
    return float(s.depths(camera=3)[72, 128]) + 0.1


@program(options=_CUBES, resets=1000, seconds=Near(0.0, 0.001))
def resets(s: Session) -> Found:
    """Reset a thousand times after a flight: that takes no simulated time."""
    s.take_off()
    begin, home = s.seconds(), 0
    for _ in range(1000):
        s.client.reset()
        home += s.place() == [0.0, 0.0, 0.0]
    return {"resets": home, "seconds": s.seconds() - begin}


@program(
    since="airsim-1.2",
    options=_CUBES,
    settings=_POSING,
    names=["cube_0", "cube_1", "cube_2"],
    moved=[True, False],
    there=Near([9.0, 1.0, -2.5], 1e-4),
    missing=True,
)
def objects(s: Session) -> Found:
    """List, move and find objects."""
    names = s.client.simListSceneObjects("cube.*")
    moved = [s.client.simSetObjectPose(n, s.pose(9, 1, -2.5), True) for n in (names[0], "tree")]
    missing = s.client.simGetObjectPose("tree").position.x_val
    return {
        "names": sorted(names),
        "moved": moved,
        "there": components(s.client.simGetObjectPose(names[0]).position),
        "missing": math.isnan(missing),
    }


@program(
    since="airsim",
    settings=_POSING,
    listed=[True, False],
    distances=Near([9.0, 1.0], 0.01),
    removed=[True, False],
)
def spawn(s: Session) -> Found:
    """Spawn a cube of 2 m, 10 m ahead of the camera, and destroy it: then only the sky is there."""
    camera = s.client.simGetCameraInfo("0").pose.position
    up = s.client.simGetObjectPose(s.vehicle()).position.z_val - s.place()[2]
    there = s.pose(camera.x_val + 10, camera.y_val, camera.z_val + up)
    name = s.client.simSpawnObject("box", "Cube", there, s.vector(2, 2, 2))
    listed = [name in s.client.simListSceneObjects()]
    distances = [float(s.depths()[72, 128])]
    removed = [s.client.simDestroyObject(name)]
    listed.append(name in s.client.simListSceneObjects())
    removed.append(s.client.simDestroyObject(name))
    distances.append(float(s.depths()[70, 128] > 1000))
    return {"listed": listed, "distances": distances, "removed": removed}


@program(
    since="airsim-1.2",
    options=_BLOCKS,
    settings=_POSING,
    contrasts=Near([1.0, 0.37, 1.0], 0.05),
    rain=True,
    same=True,
)
def weather(s: Session) -> Found:
    """Fog with a visibility of 20 m at most; rain, which does nothing; and clear air again."""
    s.client.simEnableWeather(True)
    fog, rain = s.airsim.WeatherParameter.Fog, s.airsim.WeatherParameter.Rain
    clear = s.colors()
    s.client.simSetWeatherParameter(rain, 0.5)
    wet = s.colors()
    s.client.simSetWeatherParameter(fog, 1.0)
    contrasts = [_contrast(image) for image in (clear, s.colors())]
    s.client.simSetWeatherParameter(fog, 0.0)
    after = s.colors()
    return {
        "contrasts": [c / contrasts[0] for c in (*contrasts, _contrast(after))],
        "rain": bool((wet == clear).all()),
        "same": bool((after == clear).all()),
    }


def _contrast(image: Any) -> float:
    return float(np.abs(image[..., :3].astype(float) - image[0, 128, :3]).mean())


@program(
    since="airsim-1.2",
    settings=_POSING,
    night=Near([0.35 * 0.5, 0.35 * 0.54, 0.35 * 0.48], 0.01),
    brighter=True,
    same=True,
)
def time_of_day(s: Session) -> Found:
    """At midnight only the ambient light, 0.35, is left on the ground, whose color is known."""
    before = s.colors(camera=3)
    s.client.simSetTimeOfDay(True, "2026-06-21 00:00:00")
    night = s.colors(camera=3)[72, 128] / 255
    s.client.simSetTimeOfDay(True, "2026-06-21 12:00:00")
    noon = s.colors(camera=3)[72, 128] / 255
    s.client.simSetTimeOfDay(False)
    rgb = night[:3][::-1] if s.airsim.__name__ == "airsim" and len(night) == 3 else night[:3]
    return {
        "night": rgb.tolist(),
        "brighter": bool((noon > night)[:3].all()),
        "same": bool((s.colors(camera=3) == before).all()),
    }


@program(
    since="airsim",
    settings="""{"SimMode": "ComputerVision", "Recording": {"RecordOnMove": true,
      "RecordInterval": 0.2, "Folder": "FOLDER", "Cameras": [
        {"CameraName": "0", "ImageType": 0, "PixelsAsFloat": false, "Compress": true},
        {"CameraName": "3", "ImageType": 1, "PixelsAsFloat": true, "Compress": false}]}}""",
    recording=[True, False],
    rows=10,
    x=Near([float(i) for i in range(1, 11)], 1e-4),
    kinds={version: {".png": 10, ".pfm": 10} for version in VERSIONS},
)
def recordings(s: Session) -> Found:
    """Record two images at each of ten places, 1.2 s each: without a move, no rows."""
    s.client.simPause(True)
    s.client.startRecording()
    recording = [s.client.isRecording()]
    for step in range(1, 11):
        s.client.simContinueForTime(0.9)
        s.put(s.pose(step, 0, 0))
        s.client.simContinueForTime(0.3)
    s.client.stopRecording()
    recording.append(s.client.isRecording())
    folder = Path(json.loads(s.client.getSettingsString())["Recording"]["Folder"])
    (table,) = folder.glob("*/airsim_rec.txt")
    header, *rows = (line.split("\t") for line in table.read_text().splitlines())
    kinds: dict[str, int] = {}
    for image in (folder / table.parent / "images").iterdir():
        kinds[image.suffix] = kinds.get(image.suffix, 0) + (image.stat().st_size > 0)
    column = header.index("POS_X")
    return {
        "recording": recording,
        "rows": len(rows),
        "x": [float(row[column]) for row in rows],
        "kinds": kinds,
    }
