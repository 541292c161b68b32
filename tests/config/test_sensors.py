import pytest

from drone_rl.config.sensors import (
    BarometerSettings,
    GpsSettings,
    ImuSettings,
    MagnetometerSettings,
)
from drone_rl.utils.errors import InputError


def test_an_unknown_field_is_refused():
    with pytest.raises(InputError, match="field='moon': it must be 'dipole' or 'constant'"):
        MagnetometerSettings(field="moon")


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
        with pytest.raises(InputError, match=rf"^{name}=.*: it must be"):
            settings(**{name: value * 1.001})
