"""Simulated sensors other than cameras: IMU, barometer, magnetometer and GPS."""

from drone_rl.sim.sensors.instruments import BarometerReading as BarometerReading
from drone_rl.sim.sensors.instruments import Fix as Fix
from drone_rl.sim.sensors.instruments import GpsReading as GpsReading
from drone_rl.sim.sensors.instruments import ImuReading as ImuReading
from drone_rl.sim.sensors.instruments import MagnetometerReading as MagnetometerReading
from drone_rl.sim.sensors.suite import Sensors as Sensors
