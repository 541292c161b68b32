"""Readings of a vehicle's sensors as messages of AirSim."""

import math

from torch import Tensor

from drone_rl.flight.airsim import messages
from drone_rl.flight.airsim.messages import Map, nanoseconds, ned
from drone_rl.flight.commands.state import Sensors
from drone_rl.sim.coordinates import ned_attitude_from_world


def _time(of: Tensor, epoch: int) -> int:
    """Return the time stamp of a reading; 0 if there is none yet."""
    seconds = float(of[0])
    return epoch + nanoseconds(seconds) if math.isfinite(seconds) else 0


def _imu(sensors: Sensors, epoch: int) -> Map:
    reading = sensors.imu()
    turn = ned_attitude_from_world(reading.attitude[0]).tolist()
    return {
        "time_stamp": _time(reading.time, epoch),
        "orientation": messages.quaternion(turn),
        "angular_velocity": messages.vector(ned(reading.angular_velocity[0])),
        "linear_acceleration": messages.vector(ned(reading.specific_force[0])),
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
        "magnetic_field_body": messages.vector(ned(reading.field[0])),
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
            "velocity": messages.vector(ned(reading.velocity[0])),
            "fix_type": int(reading.fix[0]),
            "time_utc": _time(reading.time, epoch) // 1000,
        },
        "is_valid": bool(reading.is_valid[0]),
    }


SENSORS = {"imu": _imu, "barometer": _barometer, "magnetometer": _magnetometer, "gps": _gps}
"""Functions of the sensors of a vehicle and the time stamp of its time 0, by kind."""
