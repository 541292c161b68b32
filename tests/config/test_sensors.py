import pytest

from drone_rl.config.sensors import (
    BarometerSettings,
    GpsSettings,
    ImuSettings,
    MagnetometerSettings,
    SensorSettings,
)
from drone_rl.utils.errors import InputError


@pytest.mark.parametrize(
    ("settings", "change"),
    [
        (ImuSettings, {"rate": 0.0}),
        (ImuSettings, {"noise": -1.0}),
        (ImuSettings, {"gyro_bias_time": 0.0}),
        (BarometerSettings, {"white_noise": float("nan")}),
        (BarometerSettings, {"latency": 11.0}),
        (MagnetometerSettings, {"bias": -0.1}),
        (GpsSettings, {"error_time": 0.0}),
        (GpsSettings, {"horizontal_noise": float("inf")}),
    ],
)
def test_what_no_sensor_is_like_is_refused(settings, change):
    (name,) = change
    with pytest.raises(InputError, match=rf"^{name}=.* is out of range"):
        settings(**change)


def test_an_unknown_field_is_refused():
    with pytest.raises(InputError, match="field='moon' is unknown; give dipole, constant"):
        MagnetometerSettings(field="moon")


def test_perfect_sensors_differ_in_their_noise_alone():
    chosen = SensorSettings(gps=GpsSettings(rate=10.0, horizontal_noise=1.0))
    perfect = chosen.perfect
    assert perfect.gps == GpsSettings(rate=10.0, horizontal_noise=1.0, noise=0.0)
    kinds = (perfect.imu, perfect.barometer, perfect.magnetometer, perfect.gps)
    assert all(kind.noise == 0.0 for kind in kinds)
    assert perfect.gps.values()["rate"] == 10.0


def test_default_values():
    """AirSim's where it has one: rates in Hz, latencies in seconds, errors in metres."""
    sensors = SensorSettings()
    rates = [
        one.rate for one in (sensors.imu, sensors.barometer, sensors.magnetometer, sensors.gps)
    ]
    assert rates == [1000.0, 50.0, 50.0, 50.0]
    assert (sensors.gps.latency, sensors.gps.startup) == (0.2, 1.0)
    assert (sensors.barometer.latency, sensors.magnetometer.latency) == (0.0, 0.0)
    gps, imu = sensors.gps, sensors.imu
    assert (gps.first_error, gps.last_error, gps.error_time) == (100.0, 0.1, 0.9)
    assert (gps.error_3d, gps.error_2d) == (3.0, 4.0)
    assert (imu.gyro_random_walk, imu.gyro_bias_stability, imu.gyro_bias_time) == (0.30, 4.6, 500.0)
    assert (imu.accel_random_walk, imu.accel_bias_stability) == (0.24, 36.0)
    assert (imu.accel_bias_time, imu.accel_turn_on_bias, imu.gyro_turn_on_bias) == (800.0, 0.0, 0.0)
    barometer, magnetometer = sensors.barometer, sensors.magnetometer
    assert (barometer.sea_level_pressure, barometer.white_noise) == (1013.25, 2.7)
    assert (barometer.drift, barometer.drift_time) == (0.001825, 3600.0)
    assert (magnetometer.scale, magnetometer.white_noise, magnetometer.bias) == (1.0, 0.005, 0.0)
    assert (gps.horizontal_noise, gps.vertical_noise, gps.velocity_noise) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("settings", "largest"),
    [
        (ImuSettings, {"rate": 100_000.0, "gyro_bias_time": 1e9, "noise": 1000.0}),
        (GpsSettings, {"latency": 10.0, "startup": 10.0, "first_error": 10_000.0}),
        (BarometerSettings, {"sea_level_pressure": 2000.0, "white_noise": 10_000.0, "drift": 1.0}),
        (MagnetometerSettings, {"white_noise": 100.0, "bias": 100.0, "scale": 1000.0}),
    ],
)
def test_the_largest_values_are_accepted_and_larger_ones_refused(settings, largest):
    settings(**largest)
    for name, value in largest.items():
        with pytest.raises(InputError, match=rf"^{name}=.* is out of range"):
            settings(**{name: value * 1.001})
