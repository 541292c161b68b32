"""Readings of a vehicle's sensors as messages of AirSim."""

import math

from drone_rl.flight.airsim import messages
from drone_rl.flight.airsim.messages import Map, nanoseconds, ned
from drone_rl.sim.coordinates import ned_attitude_from_world
from drone_rl.sim.sensors import Sensors


def _time(seconds: float, epoch: int) -> int:
    """Return the time stamp of a reading; 0 if there is none yet."""
    return epoch + nanoseconds(seconds) if math.isfinite(seconds) else 0


def _imu(sensors: Sensors, epoch: int) -> Map:
    reading = sensors.imu()
    turn = ned_attitude_from_world(reading.attitude).tolist()
    return {
        "time_stamp": _time(reading.time, epoch),
        "orientation": messages.quaternion(turn),
        "angular_velocity": messages.vector(ned(reading.angular_velocity)),
        "linear_acceleration": messages.vector(ned(reading.specific_force)),
    }


def _barometer(sensors: Sensors, epoch: int) -> Map:
    reading = sensors.barometer()
    return {
        "time_stamp": _time(reading.time, epoch),
        "altitude": reading.altitude,
        "pressure": reading.pressure,
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
    return {
        "time_stamp": _time(reading.time, epoch),
        "gnss": {
            "geo_point": messages.geo_point(reading.place.tolist()),
            "eph": reading.error,
            "epv": reading.error,
            "velocity": messages.vector(ned(reading.velocity)),
            "fix_type": int(reading.fix),
            "time_utc": _time(reading.time, epoch) // 1000,
        },
        "is_valid": reading.is_valid,
    }


SENSORS = {"imu": _imu, "barometer": _barometer, "magnetometer": _magnetometer, "gps": _gps}
"""Functions of the sensors of a vehicle and the time stamp of its time 0, by kind."""
