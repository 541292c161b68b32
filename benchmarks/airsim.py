"""The server for AirSim's clients: speed, methods, crafted bytes, memory, repeatability."""

import contextlib
import random
import re
import socket
import subprocess
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgpack

from benchmarks.commands import memory_status
from drone_rl.flight.airsim.methods import METHODS, UNSUPPORTED
from drone_rl.sweeps.executors import PROGRAM

_READY = re.compile(r"127\.0\.0\.1:(\d+)")
_YAW = {"is_rate": True, "yaw_or_rate": 0.0}
_REQUEST = {"camera_name": "0", "image_type": 0, "pixels_as_float": False, "compress": False}
_POSING = '{"SimMode": "ComputerVision"}'


def _packed(value: Any) -> bytes:
    packed: Any = msgpack.packb(value)
    return packed


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


METHODS_1_8 = _words(
    """
    armDisarm cancelLastTask enableApiControl getBarometerData getCarControls getCarState
    getDistanceSensorData getGpsData getHomeGeoPoint getImuData getLidarData getMagnetometerData
    getMinRequiredClientVersion getMultirotorState getRotorStates getServerVersion getSettingsString
    goHome hover isApiControlEnabled isRecording land listVehicles moveByAngleRatesThrottle
    moveByAngleRatesZ moveByManual moveByMotorPWMs moveByRC moveByRollPitchYawThrottle
    moveByRollPitchYawZ moveByRollPitchYawrateThrottle moveByRollPitchYawrateZ moveByVelocity
    moveByVelocityBodyFrame moveByVelocityZ moveByVelocityZBodyFrame moveOnPath moveToGPS
    moveToPosition moveToZ ping reset rotateByYawRate rotateToYaw setAngleLevelControllerGains
    setAngleRateControllerGains setCarControls setPositionControllerGains setVelocityControllerGains
    simAddDetectionFilterMeshName simAddVehicle simClearDetectionMeshNames simContinueForFrames
    simContinueForTime simCreateVoxelGrid simDestroyObject simEnableFocusPlane simEnableManualFocus
    simEnableWeather simFlushPersistentMarkers simGetCameraInfo simGetCollisionInfo
    simGetCurrentFieldOfView simGetDetections simGetDistortionParams simGetFilmbackSettings
    simGetFocalLength simGetFocusAperture simGetFocusDistance simGetGroundTruthEnvironment
    simGetGroundTruthKinematics simGetImage simGetImages simGetLensSettings
    simGetMeshPositionVertexBuffers simGetObjectPose simGetObjectScale simGetPresetFilmbackSettings
    simGetPresetLensSettings simGetSegmentationObjectID simGetVehiclePose simGetWorldExtents
    simIsPaused simListAssets simListSceneObjects simLoadLevel simPause simPlotArrows
    simPlotLineList simPlotLineStrip simPlotPoints simPlotStrings simPlotTransforms
    simPlotTransformsWithNames simPrintLogMessage simRunConsoleCommand simSetCameraFov
    simSetCameraPose simSetDetectionFilterRadius simSetDistortionParam simSetFilmbackSettings
    simSetFocalLength simSetFocusAperture simSetFocusDistance simSetKinematics simSetLightIntensity
    simSetObjectMaterial simSetObjectMaterialFromTexture simSetObjectPose simSetObjectScale
    simSetPresetFilmbackSettings simSetPresetLensSettings simSetSegmentationObjectID simSetTimeOfDay
    simSetTraceLine simSetVehiclePose simSetWeatherParameter simSetWind simSpawnObject
    simSwapTextures simTestLineOfSightBetweenPoints simTestLineOfSightToPoint startRecording
    stopRecording takeoff
    """
)
"""Methods that the multirotor client 1.8.1 calls, those of cars and lidar included."""


class Peer:
    """A client of raw sockets."""

    def __init__(self, port: int) -> None:
        self._socket = socket.create_connection(("127.0.0.1", port), timeout=300)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._unpacker = msgpack.Unpacker(raw=False, strict_map_key=False)
        self._number = 0

    def call(self, method: str, *args: Any) -> Any:
        """Return the result; raise a RuntimeError with the server's message."""
        self._number += 1
        self._socket.sendall(_packed([0, self._number, method, args]))
        while True:
            for _, _, error, result in self._unpacker:
                if error is not None:
                    raise RuntimeError(error)
                return result
            data = self._socket.recv(2**20)
            if not data:
                raise RuntimeError("the server has closed the connection")
            self._unpacker.feed(data)

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()


@contextlib.contextmanager
def served(folder: Path, *args: str, settings: str = "{}") -> Iterator[tuple[int, int, float]]:
    """Run `drone-rl serve`; yield its port, its process and the seconds until it was ready."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "settings.json").write_text(settings)
    given = [f"settings={folder / 'settings.json'}", "port=0", f"hydra.run.dir={folder / 'run'}"]
    begin = time.perf_counter()
    process = subprocess.Popen(
        [*PROGRAM, "serve", *given, *args],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    try:
        assert process.stdout is not None
        for line in process.stdout:
            if found := _READY.search(line):
                # a full pipe would block the server, which logs a line for each error
                threading.Thread(target=deque, args=(process.stdout, 0), daemon=True).start()
                yield int(found[1]), process.pid, time.perf_counter() - begin
                break
        else:
            raise RuntimeError("drone-rl serve has ended before it was ready")
    finally:
        process.terminate()
        process.wait(30)


def bench_airsim(folder: Path, quick: bool) -> dict[str, Any]:
    """Measure the server.

    Returns:
        "airsim_images_per_s": simGetImages, raw scene of 144x256, round trips per second of one
        client; "airsim_calls_per_s": simGetVehiclePose likewise; "airsim_lockstep_factor":
        simulated over real seconds while a drone flies; "airsim_continue_s": simulated seconds of
        200 calls of `simContinueForTime` of 0.01 s, and of 0.05 s; "airsim_ready_s": from the
        command to its first connection; "airsim_methods_share": of `asked_for`;
        "airsim_fuzz_survived": crafted messages after which other clients are served;
        "airsim_growth_mib": growth of memory over an hour of simulated traffic;
        "airsim_lockstep_repeats": whether two runs of a script have the same states, byte for byte.
    """
    share = 0.05 if quick else 1.0
    with served(folder / "posing", "clock=lockstep", settings=_POSING) as (port, _, ready):
        images = _rate(port, 5 * share, lambda p: p.call("simGetImages", [_REQUEST], ""))
        calls = _rate(port, 5 * share, lambda p: p.call("simGetVehiclePose", ""))
    with served(folder / "flying", "clock=lockstep", "scene=empty") as (port, _, _):
        factor = _factor(port, 600 * share)
        continued = [_continued(port, 200, seconds) for seconds in (0.01, 0.05)]
    states = [_script(folder / f"script_{i}") for i in range(2)]
    with served(folder / "fuzzed", "clock=lockstep", "scene=empty") as (port, _, _):
        survived = fuzz(port, round(100_000 * share))
    with served(folder / "growing", "clock=lockstep", "scene=empty") as (port, pid, _):
        growth = _growth(port, pid, 3600 * share)
    known = asked_for()
    return {
        "airsim_images_per_s": images,
        "airsim_calls_per_s": calls,
        "airsim_lockstep_factor": factor,
        "airsim_continue_s": continued,
        "airsim_ready_s": ready,
        "airsim_methods_share": len(known & METHODS.keys()) / len(known),
        "airsim_fuzz_survived": survived,
        "airsim_growth_mib": growth,
        "airsim_lockstep_repeats": states[0] == states[1],
    }


def asked_for() -> frozenset[str]:
    """Return the methods that need no lidar, distance sensor, car, or part of Unreal."""
    return frozenset(
        name
        for name in METHODS_1_8
        if not re.match("lidar|distance sensors|cars|.* of Unreal", UNSUPPORTED.get(name, ""))
    )


def _rate(port: int, seconds: float, call: Callable[[Peer], Any]) -> float:
    """Return round trips per second of one client."""
    peer, count = Peer(port), 0
    for _ in range(20):
        call(peer)
    begin = time.perf_counter()
    while time.perf_counter() - begin < seconds:
        call(peer)
        count += 1
    elapsed = time.perf_counter() - begin
    peer.close()
    return count / elapsed


def _factor(port: int, seconds: float) -> float:
    """Return simulated over real seconds while one drone flies in a circle."""
    peer = Peer(port)
    peer.call("enableApiControl", True, "")
    peer.call("takeoff", 20.0, "")
    begin, start = time.perf_counter(), peer.call("timestampNow")
    leg = 30.0
    for i in range(max(1, round(seconds / leg))):
        peer.call("moveByVelocity", 2.0 * (-1) ** i, 1.0, 0.0, leg, 0, _YAW, "")
    passed = (peer.call("timestampNow") - start) / 1e9
    peer.close()
    return passed / (time.perf_counter() - begin)


def _continued(port: int, count: int, seconds: float) -> float:
    """Return the simulated seconds of calls of `simContinueForTime`."""
    peer = Peer(port)
    peer.call("simPause", True)
    start = peer.call("timestampNow")
    for _ in range(count):
        peer.call("simContinueForTime", seconds)
    passed = (peer.call("timestampNow") - start) / 1e9
    peer.call("simPause", False)
    peer.close()
    return passed


def _script(folder: Path) -> bytes:
    """Return the states along a flight with gusts and sensors, packed."""
    with served(folder, "clock=lockstep", "seed=3", "scene=cubes") as (port, _, _):
        peer, states = Peer(port), []
        peer.call("enableApiControl", True, "")
        peer.call("takeoff", 20.0, "")
        for i in range(10):
            peer.call("moveByVelocity", 2.0, (-1.0) ** i, 0.0, 1.0, 0, _YAW, "")
            states += [peer.call("getMultirotorState", ""), peer.call("getImuData", "", "")]
            states.append(peer.call("simGetImage", "0", 0, ""))
        peer.close()
    return _packed(states)


def fuzz(port: int, count: int, seed: int = 0) -> int:
    """Send crafted messages.

    Returns:
        Those after which another client was still served, as was tried after every hundred.
    """
    draw, other, survived = random.Random(seed), Peer(port), 0
    for first in range(0, count, 100):
        number = min(100, count - first)
        connection = socket.create_connection(("127.0.0.1", port), timeout=10)
        connection.settimeout(0.0)
        for _ in range(number):
            try:
                connection.sendall(_crafted(draw))
                with contextlib.suppress(BlockingIOError):
                    connection.recv(2**20)
            except OSError:  # the server has closed it: go on with another one
                connection.close()
                connection = socket.create_connection(("127.0.0.1", port), timeout=10)
                connection.settimeout(0.0)
        connection.close()
        if other.call("ping") is not True:
            return survived
        survived += number
    other.close()
    return survived


def _crafted(draw: random.Random) -> bytes:
    """Return a message that is wrong in one of several ways."""
    names = [*METHODS, *UNSUPPORTED, "x" * 1000, ""]
    method = draw.choice([name for name in names if name not in ("startRecording", "reset")])
    good = _packed([0, draw.randrange(2**31), method, [_value(draw) for _ in range(9)]])
    kind = draw.randrange(8)
    if kind == 0:
        return good[: draw.randrange(len(good))] + b"\xc1"
    if kind == 1:
        return bytes(draw.randrange(256) for _ in range(draw.randrange(1, 60)))
    if kind == 2:
        return b"\x91" * draw.randrange(1, 3000)
    if kind == 3:
        return b"\xdd" + draw.randrange(2**32).to_bytes(4, "big")
    if kind == 4:
        place = draw.randrange(len(good))
        return good[:place] + bytes([draw.randrange(256)]) + good[place + 1 :]
    return good


def _value(draw: random.Random, depth: int = 0) -> Any:
    """Return any value, often of a wrong type."""
    plain = [
        None,
        True,
        -1,
        2**63,
        float("nan"),
        float("inf"),
        1e308,
        "",
        "0",
        "x" * draw.randrange(300),
        b"\xff" * draw.randrange(30),
        0.5,
        _REQUEST,
        _YAW,
        {"x_val": 1.0, "y_val": float("nan"), "z_val": 2.0},
    ]
    if depth < 3 and draw.random() < 0.3:
        return [_value(draw, depth + 1) for _ in range(draw.randrange(4))]
    if depth < 3 and draw.random() < 0.2:
        return {str(draw.randrange(9)): _value(draw, depth + 1) for _ in range(draw.randrange(4))}
    return draw.choice(plain)


def _growth(port: int, pid: int, seconds: float) -> float:
    """Return the growth of the server's memory over traffic for some simulated seconds, MiB."""
    peer = Peer(port)
    peer.call("enableApiControl", True, "")
    peer.call("takeoff", 20.0, "")

    def traffic(simulated: float) -> None:
        for i in range(max(1, round(simulated / 5))):
            peer.call("moveByVelocity", (-1.0) ** i, 0.0, 0.0, 5.0, 0, _YAW, "")
            peer.call("getMultirotorState", "")
            peer.call("simGetCollisionInfo", "")
            if i % 10 == 0:
                peer.call("simGetImages", [_REQUEST], "")

    traffic(seconds / 10)  # caches fill
    before = memory_status(pid)["VmRSS"]
    traffic(seconds)
    after = memory_status(pid)["VmRSS"]
    peer.close()
    return after - before
