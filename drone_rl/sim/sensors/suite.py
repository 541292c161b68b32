"""All sensors of a drone together."""

from drone_rl.config.sensors import SensorSettings
from drone_rl.sim.coordinates import HOME, GeoPoint
from drone_rl.sim.dynamics.state import BodyState
from drone_rl.sim.sensors.instruments import (
    Barometer,
    BarometerReading,
    Gps,
    GpsReading,
    Imu,
    ImuReading,
    Magnetometer,
    MagnetometerReading,
)
from drone_rl.utils.seeding import Stream, torch_generator


class Sensors:
    """IMU, barometer, magnetometer and GPS receiver of one drone, each with a random stream.

    A pilot updates them in each control period, seven ticks by default, even if a sensor's rate is
    higher.
    """

    def __init__(
        self, body: BodyState, settings: SensorSettings, seed: int = 0, home: GeoPoint = HOME
    ) -> None:
        """Turn the sensors of one drone on.

        `seed` is that of the noise, and `home` the place on Earth of the world's origin. Raises an
        `InputError` if the seed is not a whole number, 0 or more.
        """
        self.settings = settings
        """Rates, latencies and noise."""
        self.time = 0.0
        """Simulated seconds since the sensors were turned on; the clock of the readings."""
        streams = [torch_generator(seed, Stream.SENSORS, number=i) for i in range(4)]
        self._imu = Imu(settings.imu, body, streams[0])
        self._barometer = Barometer(settings.barometer, streams[1], home)
        self._magnetometer = Magnetometer(settings.magnetometer, streams[2], home)
        self._gps = Gps(settings.gps, streams[3], home)
        self.update(body, 0.0)

    def update(self, body: BodyState, seconds: float) -> None:
        """Advance the sensors to the state `body`, some seconds later; see `Sensor.update`."""
        self.time += seconds
        for sensor in (self._imu, self._barometer, self._magnetometer, self._gps):
            sensor.update(body, self.time)

    def imu(self) -> ImuReading:
        """Return specific force, angular rates and attitude."""
        return self._imu.read()

    def barometer(self) -> BarometerReading:
        """Return pressure and the corresponding altitude above the sea."""
        return self._barometer.read()

    def magnetometer(self) -> MagnetometerReading:
        """Return Earth's magnetic field."""
        return self._magnetometer.read()

    def gps(self) -> GpsReading:
        """Return place on Earth and velocity; `is_valid` from the first reading on, see `fix`."""
        return self._gps.read()
