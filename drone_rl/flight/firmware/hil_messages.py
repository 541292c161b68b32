"""MAVLink's messages of hardware in the loop: what their fields are of what a drone senses.

Pure functions. MAVLink's frames are NED and FRD; its units are in the names below.
"""

import math
from typing import Any

import numpy as np

from drone_rl.flight.firmware.senses import Senses, Vector, into_body
from drone_rl.sim.coordinates import frd_from_body, ned_from_world, world_from_ned

ROTORS = 4
ARMED = 128
"""The flag in a mode that says that it is armed."""
ALL_SENSORS = 0x1FFF
"""Acceleration, rates, field, both pressures, altitude and temperature are new."""
FIELD = (0.1795, 0.0490, 0.4903)
"""Earth's magnetic field at AirSim's home, north, east, down, gauss."""
TEMPERATURE = 15.0
"""Of the air, degrees Celsius."""
_FIX_3D, _SATELLITES, _NOT_KNOWN = 3, 12, 65535


def sensor_fields(senses: Senses) -> dict[str, Any]:
    """Fields of HIL_SENSOR: microseconds, m/s2, rad/s, gauss, hectopascals, metres, Celsius."""
    force, rates = frd_from_body(senses.force), frd_from_body(senses.rates)
    field = frd_from_body(into_body(senses.attitude, world_from_ned(np.array(FIELD))))
    return {
        "time_usec": round(senses.time * 1e6),
        **dict(zip(("xacc", "yacc", "zacc"), map(float, force), strict=True)),
        **dict(zip(("xgyro", "ygyro", "zgyro"), map(float, rates), strict=True)),
        **dict(zip(("xmag", "ymag", "zmag"), map(float, field), strict=True)),
        "abs_pressure": senses.pressure / 100.0,
        "diff_pressure": 0.0,
        "pressure_alt": senses.altitude,
        "temperature": TEMPERATURE,
        "fields_updated": ALL_SENSORS,
    }


def gps_fields(senses: Senses) -> dict[str, Any]:
    """Fields of HIL_GPS: microseconds, 1e-7 degrees, millimetres, centimetres a second."""
    latitude, longitude, altitude = senses.place
    north, east, down = ned_from_world(senses.velocity) * 100.0
    speed = math.hypot(north, east)
    course = math.degrees(math.atan2(east, north)) % 360.0
    return {
        "time_usec": round(senses.time * 1e6),
        "fix_type": _FIX_3D,
        "lat": round(latitude * 1e7),
        "lon": round(longitude * 1e7),
        "alt": round(altitude * 1e3),
        "eph": 100,
        "epv": 100,
        "vel": min(round(speed), _NOT_KNOWN - 1),
        "vn": _short(north),
        "ve": _short(east),
        "vd": _short(down),
        "cog": round(course * 100.0) % 36000,
        "satellites_visible": _SATELLITES,
    }


def rotors_of(controls: list[float], mode: int) -> Vector:
    """What HIL_ACTUATOR_CONTROLS asks of the rotors of an X frame.

    Args:
        controls: Of its sixteen outputs, of which the first four are rotors in PX4's order, which
            is ours.
        mode: Whose flags say whether it is armed.

    Returns:
        Front right, rear left, front left, rear right, 0 to 1; all 0 where it isn't armed, and each
        where it is no number. Shape: (4,).
    """
    if not mode & ARMED:
        return np.zeros(ROTORS)
    rotors = np.array(controls[:ROTORS], dtype=np.float64)
    return np.nan_to_num(rotors, nan=0.0, posinf=0.0, neginf=0.0).clip(0.0, 1.0)


def _short(value: float) -> int:
    return max(-32768, min(32767, round(float(value))))
