"""What a pilot reads beside pictures: the sensors of one drone, while its time passes."""

from drone_rl.config.sensors import SensorSettings
from drone_rl.sim.dynamics import FlightState
from drone_rl.sim.sensors import (
    BarometerReading,
    CollisionState,
    GpsReading,
    ImuReading,
    MagnetometerReading,
    SensorSuite,
)


class Sensors:
    """Accelerometer and gyroscope, barometer, magnetometer, GPS, and what was touched.

    Readings have the shapes of one drone among many, (1, *). They are taken at the drone's control
    periods, seven ticks by default: a sensor whose rate is higher tells one reading for each.
    """

    def __init__(self, body: FlightState, settings: SensorSettings, seed: int = 0) -> None:
        """Turns them on.

        Args:
            body: One drone, now.
            settings: Rates, latencies, noise.
            seed: Of the noise.
        """
        self._senses = SensorSuite(settings, seed=seed)
        self._state = self._senses.start(body)

    @property
    def settings(self) -> SensorSettings:
        """Rates, latencies, noise."""
        return self._senses.settings

    @property
    def time(self) -> float:
        """Simulated seconds since they were turned on; readings have this clock."""
        return float(self._state.time[0])

    def update(self, body: FlightState, seconds: float) -> None:
        """Lets time pass; `body` is the drone after it."""
        self._state = self._senses.update(self._state, body, seconds)

    def imu(self) -> ImuReading:
        """Specific force, rates of turning, attitude."""
        return self._senses.read_imu(self._state)

    def barometer(self) -> BarometerReading:
        """Pressure, and the altitude above the sea that it stands for."""
        return self._senses.read_barometer(self._state)

    def magnetometer(self) -> MagnetometerReading:
        """Earth's field."""
        return self._senses.read_magnetometer(self._state)

    def gps(self) -> GpsReading:
        """Place on Earth and velocity; invalid until the receiver has found its satellites."""
        return self._senses.read_gps(self._state)

    def collision(self) -> CollisionState:
        """What was last touched; whether that is news since the last time this was asked."""
        told, self._state = self._senses.read_collision(self._state)
        return told
