"""Settings of sensors: rates, latencies and noise; AirSim's defaults where it has them."""

from typing import Annotated

from drone_rl.config.values import Fraction
from drone_rl.utils.schema import OneOf, Real
from drone_rl.utils.settings import Settings

FIELDS = ("dipole", "constant")
Rate = Annotated[float, Real(0.0, 100_000.0, is_above=True, unit="Hz")]
Latency = Annotated[float, Real(0.0, 10.0, unit="s")]
Seconds = Annotated[float, Real(0.0, 1e9, is_above=True, unit="s")]
Factor = Annotated[float, Real(0.0, 1000.0)]
Metres = Annotated[float, Real(0.0, 10_000.0, unit="m")]


class ImuSettings(Settings):
    """Accelerometer and gyroscope; the defaults are an MPU-6000's."""

    rate: Rate = 1000.0
    """Readings per second, at most one per simulation tick."""
    noise: Factor = 1.0
    """Factor on all noise, bias and drift amplitudes below; 0 for a noise-free sensor."""
    gyro_random_walk: Annotated[float, Real(0.0, 1000.0, unit="degrees/sqrt(h)")] = 0.30
    """Angle random walk: standard deviation of the integrated rate after an hour, in degrees."""
    gyro_bias_stability: Annotated[float, Real(0.0, 1e6, unit="degrees/h")] = 4.6
    """Standard deviation of the change of the bias over `gyro_bias_time`, in degrees per hour."""
    gyro_bias_time: Seconds = 500.0
    """Time to which `gyro_bias_stability` refers, in seconds."""
    gyro_turn_on_bias: Annotated[float, Real(0.0, 1e6, unit="degrees/h")] = 0.0
    """Standard deviation of the bias at the start, in degrees per hour."""
    accel_random_walk: Annotated[float, Real(0.0, 1e6, unit="mg/sqrt(Hz)")] = 0.24
    """Noise density of the accelerometer, in milli-g per root hertz (velocity random walk)."""
    accel_bias_stability: Annotated[float, Real(0.0, 1e6, unit="ug")] = 36.0
    """Standard deviation of the change of the bias over `accel_bias_time`, in micro-g."""
    accel_bias_time: Seconds = 800.0
    """Time to which `accel_bias_stability` refers, in seconds."""
    accel_turn_on_bias: Annotated[float, Real(0.0, 1e6, unit="mg")] = 0.0
    """Standard deviation of the bias at the start, in milli-g."""


class BarometerSettings(Settings):
    """Pressure of the standard atmosphere."""

    rate: Rate = 50.0
    """Readings per second."""
    latency: Latency = 0.0
    """Age of a reading when it is reported, in seconds."""
    sea_level_pressure: Annotated[float, Real(100.0, 2000.0, unit="hPa")] = 1013.25
    """Sea-level pressure of the day, in hectopascals; the altimeter is set to it (QNH)."""
    noise: Factor = 1.0
    """Factor on all noise, bias and drift amplitudes below; 0 for a noise-free sensor."""
    white_noise: Annotated[float, Real(0.0, 10_000.0, unit="Pa")] = 2.7
    """Standard deviation of a reading, in pascals: about 0.2 m."""
    drift: Fraction = 0.001825
    """Stationary standard deviation of the relative pressure drift (Gauss-Markov)."""
    drift_time: Seconds = 3600.0
    """Time constant of the drift, in seconds."""


class MagnetometerSettings(Settings):
    """Earth's field along the body's axes."""

    rate: Rate = 50.0
    """Readings per second."""
    latency: Latency = 0.0
    """Age of a reading when it is reported, in seconds."""
    field: Annotated[str, OneOf(FIELDS)] = "dipole"
    """dipole: that of a dipole at Earth's centre. constant: that of Seattle, everywhere."""
    scale: Factor = 1.0
    """Scale-factor error: multiplies the measured field; 1 for none."""
    noise: Factor = 1.0
    """Factor on all noise, bias and drift amplitudes below; 0 for a noise-free sensor."""
    white_noise: Annotated[float, Real(0.0, 100.0, unit="gauss")] = 0.005
    """Standard deviation of a reading along each axis, in gauss."""
    bias: Annotated[float, Real(0.0, 100.0, unit="gauss")] = 0.0
    """Largest constant error per axis, sampled at the start, in gauss."""


class GpsSettings(Settings):
    """GPS receiver with start-up time and latency."""

    rate: Rate = 50.0
    """Readings per second; real receivers have 5 to 10."""
    latency: Latency = 0.2
    """Age of a reading when it is reported, in seconds."""
    startup: Latency = 1.0
    """Time until the first reading is taken, in seconds."""
    first_error: Metres = 100.0
    """Stated error at the start (eph and epv), in metres."""
    last_error: Metres = 0.1
    """Stated error after a long time, in metres."""
    error_time: Seconds = 0.9
    """Time constant with which the stated error decays to `last_error`, in seconds."""
    error_3d: Metres = 3.0
    """Largest stated error with a fix in three dimensions, in metres."""
    error_2d: Metres = 4.0
    """Largest stated error with a fix in two dimensions, in metres."""
    noise: Factor = 1.0
    """Factor on all noise, bias and drift amplitudes below; 0 for a noise-free sensor."""
    horizontal_noise: Metres = 0.0
    """Standard deviation of a reading to the north and to the east, in metres; AirSim has none."""
    vertical_noise: Metres = 0.0
    """The same of the altitude, in metres."""
    velocity_noise: Annotated[float, Real(0.0, 1000.0, unit="m/s")] = 0.0
    """The same of the velocity along each axis, in metres per second."""


class SensorSettings(Settings):
    """All sensors of a drone but its cameras."""

    imu: ImuSettings = ImuSettings()
    """Accelerometer and gyroscope."""
    barometer: BarometerSettings = BarometerSettings()
    """Pressure."""
    magnetometer: MagnetometerSettings = MagnetometerSettings()
    """Earth's field."""
    gps: GpsSettings = GpsSettings()
    """Position on Earth."""
