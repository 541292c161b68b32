"""Programs that read sensors, and about wind."""

import math
from typing import Any

from benchmarks.airsim_programs.program import Near, program
from benchmarks.airsim_programs.session import Session, components

Found = dict[str, Any]


def _times(s: Session, read: Any, count: int, step: float) -> list[float]:
    """Return the time stamps of readings, seconds, after each of some steps of simulated time."""
    s.client.simPause(True)
    found = []
    for _ in range(count):
        s.client.simContinueForTime(step)
        found.append(read().time_stamp / 1e9)
    return found


def _rate(times: list[float]) -> float:
    return (len(set(times)) - 1) / (times[-1] - times[0])


@program(
    since="airsim-1.2",
    standing=Near([0.0, 0.0, -9.81], 0.15),
    turning=Near([0.0, 0.0, math.pi / 6], 0.02),
    rate=Near(333.3, 1.0),
)
def imu(s: Session) -> Found:
    """Read -9.81 m/s^2 on the ground, 30 degrees/s in radians, and 333 readings a second."""
    s.client.simContinueForTime(0.5)
    s.client.simPause(False)
    standing = components(s.client.getImuData().linear_acceleration)
    s.take_off()
    s.client.rotateByYawRateAsync(30, 2).join()
    turning = components(s.client.getImuData().angular_velocity)
    times = _times(s, s.client.getImuData, 100, 0.003)
    return {"standing": standing, "turning": turning, "rate": _rate(times)}


@program(
    since="airsim-1.2",
    altitude=Near(10.0, 2.5),
    pressure=Near(-117.0, 30.0),
    qnh=Near(1013.25, 1e-3),
    rate=Near(50.0, 3.0),
)
def barometer(s: Session) -> Found:
    """Climb 10 m, where the pressure falls by 1.19 kg/m^3 9.81 m/s^2 10 m = 117 Pa.

    It drifts by 0.0018 101,325 Pa sqrt(2 10 s / 3600 s) = 14 Pa meanwhile, or 1.2 m.
    """
    s.take_off()
    lower = s.client.getBarometerData()
    s.fly("moveToZ", s.place()[2] - 10, 3)
    s.fly("moveByVelocity", 0, 0, 0, 3)
    upper = s.client.getBarometerData()
    return {
        "altitude": upper.altitude - lower.altitude,
        "pressure": upper.pressure - lower.pressure,
        "qnh": upper.qnh,
        "rate": _rate(_times(s, s.client.getBarometerData, 200, 0.006)),
    }


@program(
    since="airsim-1.2",
    place=Near([47.641468 + 20 / 111_195, -122.140165], 5e-6),
    velocity=Near([2.0, 0.0, 0.0], 0.15),
    valid=[False, True],
    fix=3,
    rate=Near(50.0, 3.0),
)
def gps(s: Session) -> Found:
    """Fly 20 m north, 111,195 m a degree; the first fix takes 1.2 s, one in 3D about 3 s."""
    valid = [s.client.getGpsData().is_valid]
    s.take_off()
    s.fly("moveToPosition", 20, 0, -5, 2)
    s.fly("moveByVelocity", 0, 0, 0, 3)
    found = s.client.getGpsData()
    point = found.gnss.geo_point
    s.fly("moveByVelocity", 2, 0, 0, 6)
    return {
        "place": [point.latitude, point.longitude],
        "velocity": components(s.client.getGpsData().gnss.velocity),
        "valid": [*valid, found.is_valid],
        "fix": found.gnss.fix_type,
        "rate": _rate(_times(s, s.client.getGpsData, 200, 0.006)),
    }


@program(
    since="airsim-1.2",
    strength=Near(0.534, 0.03),
    down=True,
    turned=Near(0.0, 0.03),
    rate=Near(50.0, 3.0),
)
def magnetometer(s: Session) -> Found:
    """Read a dipole's field: 0.312 gauss sqrt(1 + 3 0.802^2) = 0.534; it turns with the body."""
    s.client.simContinueForTime(0.1)
    s.client.simPause(False)
    north = components(s.client.getMagnetometerData().magnetic_field_body)
    s.take_off()
    s.fly("rotateToYaw", 90, 20, 1)
    s.fly("hover")
    s.client.simContinueForTime(3)
    s.client.simPause(False)
    east = components(s.client.getMagnetometerData().magnetic_field_body)
    return {
        "strength": math.hypot(*north),
        "down": north[2] > abs(north[0]),
        "turned": math.hypot(east[0] - north[1], east[1] + north[0]),
        "rate": _rate(_times(s, s.client.getMagnetometerData, 200, 0.006)),
    }


def _lean(s: Session) -> Found:
    """Fly to a place and hover there; return how far it drifts, and the pitch, degrees."""
    s.take_off()
    s.fly("moveToPosition", 2, 0, -5, 2)
    s.fly("rotateByYawRate", 0, 10)
    return {"place": s.place()[:2], "pitch": s.angles()[0]}


@program(
    settings='{"Wind": {"X": 8, "Y": 0, "Z": 0}}',
    place=Near([2.0, 0.0], 0.5),
    pitch=Near(2.46, 0.2),
)
def wind_of_the_settings(s: Session) -> Found:
    """Hover in 8 m/s from behind: 1.225 0.00538 8^2 = 0.42 N of drag, to 9.81 N: 2.46 degrees."""
    return _lean(s)


@program(since="airsim", place=Near([2.0, 0.0], 0.5), pitch=Near(-2.46, 0.2))
def wind(s: Session) -> Found:
    """Hover in wind from ahead: the nose is down."""
    s.client.simSetWind(s.vector(-8, 0, 0))
    return _lean(s)
