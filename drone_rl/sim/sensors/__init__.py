"""Simulated sensors other than cameras: IMU, barometer, magnetometer, GPS and collisions."""

from drone_rl.sim.sensors.inertial import Imu, ImuReading, Magnetometer, MagnetometerReading
from drone_rl.sim.sensors.position import Barometer, BarometerReading, Fix, Gps, GpsReading
from drone_rl.sim.sensors.suite import CollisionState, SensorSuite, SensorSuiteState

__all__ = [
    "Barometer",
    "BarometerReading",
    "CollisionState",
    "Fix",
    "Gps",
    "GpsReading",
    "Imu",
    "ImuReading",
    "Magnetometer",
    "MagnetometerReading",
    "SensorSuite",
    "SensorSuiteState",
]
