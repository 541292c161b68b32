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
