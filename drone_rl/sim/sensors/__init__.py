"""Simulated sensors other than cameras: IMU, barometer, magnetometer, GPS and collisions."""

from drone_rl.sim.sensors.instruments import (
    BarometerReading,
    Fix,
    GpsReading,
    ImuReading,
    MagnetometerReading,
)
from drone_rl.sim.sensors.suite import CollisionState, SensorSuite

__all__ = [
    "BarometerReading",
    "CollisionState",
    "Fix",
    "GpsReading",
    "ImuReading",
    "MagnetometerReading",
    "SensorSuite",
]
