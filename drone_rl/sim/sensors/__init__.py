"""What drones sense beside pictures: inertia, pressure, Earth's field, their place, and touch."""

from drone_rl.sim.sensors.barometer import Barometer, BarometerReading
from drone_rl.sim.sensors.collision import CollisionState
from drone_rl.sim.sensors.gps import Fix, Gps, GpsReading
from drone_rl.sim.sensors.imu import Imu, ImuReading
from drone_rl.sim.sensors.magnetometer import Magnetometer, MagnetometerReading
from drone_rl.sim.sensors.senses import Senses, SensesState

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
    "Senses",
    "SensesState",
]
