"""Settings of sensors: rates, latencies and noise.

The defaults are AirSim's where it has one. Each sensor has a factor on all of its noise, 0 for a
perfect one.
"""

from typing import Annotated

from drone_rl.utils.schema import OneOf, Real
from drone_rl.utils.settings import Settings

FIELDS = ("dipole", "constant")
Rate = Annotated[float, Real(0.0, 100_000.0, is_above=True, unit="Hz")]
Latency = Annotated[float, Real(0.0, 10.0, unit="s")]
Seconds = Annotated[float, Real(0.0, 1e9, is_above=True, unit="s")]
Share = Annotated[float, Real(0.0, 1000.0)]
Metres = Annotated[float, Real(0.0, 10_000.0, unit="m")]


class ImuSettings(Settings):
    """Accelerometer and gyroscope; the defaults are an MPU-6000's."""

    rate: Rate = 1000.0
    """Readings a second; one a tick where ticks are longer."""
    noise: Share = 1.0
    """Factor on all that follows; 0 for a perfect sensor."""
    gyro_random_walk: Annotated[float, Real(0.0, 1000.0, unit="degrees/sqrt(h)")] = 0.30
    """White noise of the gyroscope: how far its sum drifts in an hour, in degrees."""
    gyro_bias_stability: Annotated[float, Real(0.0, 1e6, unit="degrees/h")] = 4.6
    """How far its bias walks in the time below, in degrees an hour."""
    gyro_bias_time: Seconds = 500.0
    """That time, in seconds."""
    gyro_turn_on_bias: Annotated[float, Real(0.0, 1e6, unit="degrees/h")] = 0.0
    """Standard deviation of its bias at the start, in degrees an hour."""
    accel_random_walk: Annotated[float, Real(0.0, 1e6, unit="mg/sqrt(Hz)")] = 0.24
    """White noise of the accelerometer, in thousandths of standard gravity."""
    accel_bias_stability: Annotated[float, Real(0.0, 1e6, unit="ug")] = 36.0
    """How far its bias walks in the time below, in millionths of standard gravity."""
    accel_bias_time: Seconds = 800.0
    """That time, in seconds."""
    accel_turn_on_bias: Annotated[float, Real(0.0, 1e6, unit="mg")] = 0.0
    """Standard deviation of its bias at the start, in thousandths of standard gravity."""


class BarometerSettings(Settings):
    """Pressure of the standard atmosphere."""

    rate: Rate = 50.0
    """Readings a second."""
    latency: Latency = 0.0
    """Age of a reading when it is reported, in seconds."""
    sea_level_pressure: Annotated[float, Real(100.0, 2000.0, unit="hPa")] = 1013.25
    """The day's, known to the altimeter (QNH), in hectopascals."""
    noise: Share = 1.0
    """Factor on all that follows; 0 for a perfect sensor."""
    white_noise: Annotated[float, Real(0.0, 10_000.0, unit="Pa")] = 2.7
    """Standard deviation of a reading, in pascals: about 0.2 m."""
    drift: Annotated[float, Real(0.0, 1.0)] = 0.001825
    """Standard deviation of the slow change of pressure, as a share of it, after a long time."""
    drift_time: Seconds = 3600.0
    """In which that change forgets itself, in seconds."""


class MagnetometerSettings(Settings):
    """Earth's field along the body's axes."""

    rate: Rate = 50.0
    """Readings a second."""
    latency: Latency = 0.0
    """Age of a reading when it is reported, in seconds."""
    field: Annotated[str, OneOf(FIELDS)] = "dipole"
    """dipole, a bar magnet's in the middle of Earth, or constant, that of Seattle."""
    scale: Share = 1.0
    """Factor of a sensor that tells too much or too little; no noise."""
    noise: Share = 1.0
    """Factor on all that follows; 0 for a perfect sensor."""
    white_noise: Annotated[float, Real(0.0, 100.0, unit="gauss")] = 0.005
    """Standard deviation of a reading along each axis, in gauss."""
    bias: Annotated[float, Real(0.0, 100.0, unit="gauss")] = 0.0
    """The greatest constant error along each axis, drawn at the start, in gauss."""


class GpsSettings(Settings):
    """A receiver that finds its satellites after a while and tells where it was."""

    rate: Rate = 50.0
    """Readings a second; those of real receivers come at 5 to 10."""
    latency: Latency = 0.2
    """Age of a reading when it is reported, in seconds."""
    startup: Latency = 1.0
    """Until the first reading is taken, in seconds."""
    first_error: Metres = 100.0
    """Stated error at the start (eph and epv), in metres."""
    last_error: Metres = 0.1
    """Stated error after a long time, in metres."""
    error_time: Seconds = 0.9
    """In which the rest of it falls to 37%, in seconds."""
    error_3d: Metres = 3.0
    """Stated error up to which there is a fix in three dimensions, in metres."""
    error_2d: Metres = 4.0
    """The same in two, in metres."""
    noise: Share = 1.0
    """Factor on all that follows; 0 for a perfect sensor."""
    horizontal_noise: Metres = 0.0
    """Standard deviation of a reading to the north and to the east, in metres; AirSim has none."""
    vertical_noise: Metres = 0.0
    """The same of the altitude, in metres."""
    velocity_noise: Annotated[float, Real(0.0, 1000.0, unit="m/s")] = 0.0
    """The same of the velocity along each axis, in metres a second."""


class SensorSettings(Settings):
    """All sensors of a drone but its cameras."""

    imu: ImuSettings = ImuSettings()
    """Accelerometer and gyroscope."""
    barometer: BarometerSettings = BarometerSettings()
    """Pressure."""
    magnetometer: MagnetometerSettings = MagnetometerSettings()
    """Earth's field."""
    gps: GpsSettings = GpsSettings()
    """Place on Earth."""

    @property
    def perfect(self) -> "SensorSettings":
        """The same without any noise; rates, latencies and the stated errors of GPS stay."""
        return SensorSettings(
            imu=self.imu.replace(noise=0.0),
            barometer=self.barometer.replace(noise=0.0),
            magnetometer=self.magnetometer.replace(noise=0.0),
            gps=self.gps.replace(noise=0.0),
        )
