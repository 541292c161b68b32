"""Readings of a vehicle's sensors as messages of AirSim."""

import math

from drone_rl.flight.airsim import messages
from drone_rl.flight.airsim.messages import Map, nanoseconds, ned, ned_attitude
from drone_rl.flight.commands.state import Sensors


def read_sensor(sensors: Sensors, kind: str) -> Map:
    """Return ImuData, BarometerData, MagnetometerData or GpsData."""
    return _SENSORS[kind](sensors)


def _time(seconds: float) -> int:
    return nanoseconds(seconds) if math.isfinite(seconds) else 0


def _imu(sensors: Sensors) -> Map:
    reading = sensors.imu()
    return {
        "time_stamp": _time(float(reading.time[0])),
        "orientation": messages.quaternion(ned_attitude(reading.attitude)),
        "angular_velocity": messages.vector(ned(reading.angular_velocity)),
        "linear_acceleration": messages.vector(ned(reading.specific_force)),
    }


def _barometer(sensors: Sensors) -> Map:
    reading = sensors.barometer()
    return {
        "time_stamp": _time(float(reading.time[0])),
        "altitude": float(reading.altitude[0]),
        "pressure": float(reading.pressure[0]),
        "qnh": sensors.settings.barometer.sea_level_pressure,
    }


def _magnetometer(sensors: Sensors) -> Map:
    reading = sensors.magnetometer()
    return {
        "time_stamp": _time(float(reading.time[0])),
        "magnetic_field_body": messages.vector(ned(reading.field)),
        "magnetic_field_covariance": [],
    }


def _gps(sensors: Sensors) -> Map:
    reading = sensors.gps()
    error = float(reading.error[0])
    return {
        "time_stamp": _time(float(reading.time[0])),
        "gnss": {
            "geo_point": messages.geo_point(reading.place[0].tolist()),
            "eph": error,
            "epv": error,
            "velocity": messages.vector(ned(reading.velocity)),
            "fix_type": int(reading.fix[0]),
            "time_utc": _time(float(reading.time[0])) // 1000,
        },
        "is_valid": bool(reading.is_valid[0]),
    }


_SENSORS = {"imu": _imu, "barometer": _barometer, "magnetometer": _magnetometer, "gps": _gps}
