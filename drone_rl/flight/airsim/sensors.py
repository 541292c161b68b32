"""Readings of a vehicle's sensors as messages of AirSim."""

import math

from torch import Tensor

from drone_rl.flight.airsim import messages
from drone_rl.flight.airsim.messages import Map, nanoseconds, ned, ned_attitude
from drone_rl.flight.commands.state import Sensors


def read_sensor(sensors: Sensors, kind: str, epoch: int = 0) -> Map:
    """Return ImuData, BarometerData, MagnetometerData or GpsData.

    Args:
        sensors: Sensors of one vehicle.
        kind: imu, barometer, magnetometer or gps.
        epoch: Time stamp of the vehicle's time 0.
    """
    return _SENSORS[kind](sensors, epoch)


def _time(of: Tensor, epoch: int) -> int:
    """Return the time stamp of a reading; 0 if there is none yet."""
    seconds = float(of[0])
    return epoch + nanoseconds(seconds) if math.isfinite(seconds) else 0


def _imu(sensors: Sensors, epoch: int) -> Map:
    reading = sensors.imu()
    return {
        "time_stamp": _time(reading.time, epoch),
        "orientation": messages.quaternion(ned_attitude(reading.attitude)),
        "angular_velocity": messages.vector(ned(reading.angular_velocity)),
        "linear_acceleration": messages.vector(ned(reading.specific_force)),
    }


def _barometer(sensors: Sensors, epoch: int) -> Map:
    reading = sensors.barometer()
    return {
        "time_stamp": _time(reading.time, epoch),
        "altitude": float(reading.altitude[0]),
        "pressure": float(reading.pressure[0]),
        "qnh": sensors.settings.barometer.sea_level_pressure,
    }


def _magnetometer(sensors: Sensors, epoch: int) -> Map:
    reading = sensors.magnetometer()
    return {
        "time_stamp": _time(reading.time, epoch),
        "magnetic_field_body": messages.vector(ned(reading.field)),
        "magnetic_field_covariance": [],
    }


def _gps(sensors: Sensors, epoch: int) -> Map:
    reading = sensors.gps()
    error = float(reading.error[0])
    return {
        "time_stamp": _time(reading.time, epoch),
        "gnss": {
            "geo_point": messages.geo_point(reading.place[0].tolist()),
            "eph": error,
            "epv": error,
            "velocity": messages.vector(ned(reading.velocity)),
            "fix_type": int(reading.fix[0]),
            "time_utc": _time(reading.time, epoch) // 1000,
        },
        "is_valid": bool(reading.is_valid[0]),
    }


_SENSORS = {"imu": _imu, "barometer": _barometer, "magnetometer": _magnetometer, "gps": _gps}
