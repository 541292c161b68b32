import math

import pytest
import torch

from drone_rl.config.sensors import BarometerSettings
from drone_rl.sim.coordinates import HOME
from drone_rl.sim.dynamics.state import BodyState
from drone_rl.sim.sensors.instruments import Barometer, altitude_from_pressure_ratio, pressure_ratio

TICK = 0.003


def generator():
    return torch.Generator().manual_seed(11)


def seconds(value, count=1):
    return torch.full((count,), value, dtype=torch.float64)


def at(heights):
    position = torch.zeros(len(heights), 3, dtype=torch.float64)
    position[:, 2] = torch.tensor(heights, dtype=torch.float64)
    return BodyState.at_rest(position)


def test_pressure_matches_the_standard_atmosphere():
    """Tables: 1013.25 hPa at sea level, 898.76 at 1 km, 540.48 at 5 km, 227.00 at 11 km."""
    altitude = torch.tensor([0.0, 1000.0, 5000.0, 11_000.0], dtype=torch.float64)
    found = 1013.25 * pressure_ratio(altitude)
    torch.testing.assert_close(
        found, torch.tensor([1013.25, 898.76, 540.48, 227.00]).double(), rtol=5e-5, atol=0.0
    )
    torch.testing.assert_close(altitude_from_pressure_ratio(pressure_ratio(altitude)), altitude)
    assert pressure_ratio(seconds(20_000.0)) == pressure_ratio(seconds(12_000.0))


def test_ideal_barometer_returns_the_altitude():
    barometer = Barometer(BarometerSettings(noise=0.0, sea_level_pressure=990.0))
    state = barometer.start(at([0.0, 30.0]), seconds(0.0, 2), generator())
    reading = barometer.read(state, seconds(0.0, 2))
    torch.testing.assert_close(reading.altitude, torch.tensor([122.0, 152.0]).double())
    share = (1 - 0.0065 * 122.0 / 288.15) ** 5.255877
    assert reading.pressure[0].item() == pytest.approx(99_000.0 * share, rel=1e-6)
    assert reading.time.tolist() == [0.0, 0.0]
    elsewhere = Barometer(BarometerSettings(noise=0.0), HOME._replace(altitude=500.0))
    state = elsewhere.start(at([0.0]), seconds(0.0), generator())
    assert elsewhere.read(state, seconds(0.0)).altitude.item() == pytest.approx(500.0)


def test_readings_are_held_and_delayed():
    """At 50 Hz with 50 ms latency, the reading at 81 ms is that of 21 ms, at a height of 21 m."""
    barometer = Barometer(BarometerSettings(noise=0.0, latency=0.05))
    state, time = barometer.start(at([0.0]), seconds(0.0), generator()), seconds(0.0)
    assert barometer.read(state, time).time.item() == -math.inf
    for tick in range(1, 28):
        time = time + TICK
        state = barometer.update(state, at([3.0 * tick]), time, generator())
    reading = barometer.read(state, time)
    assert reading.time.item() == pytest.approx(0.021)
    assert reading.altitude.item() == pytest.approx(122.0 + 21.0)


def test_white_noise_is_20_cm():
    """The noise is 2.7 Pa, and the pressure gradient at 122 m is 11.88 Pa/m."""
    barometer, count = Barometer(), 20_000
    state = barometer.start(at([0.0] * count), seconds(0.0, count), generator())
    reading = barometer.read(state, seconds(0.0, count))
    assert reading.pressure.std().item() == pytest.approx(2.7, rel=0.02)
    assert reading.altitude.std().item() == pytest.approx(2.7 / 11.88, rel=0.02)
    assert reading.altitude.mean().item() == pytest.approx(122.0, abs=0.01)


@pytest.mark.parametrize("steps", [1, 20])
def test_pressure_drifts_by_about_15_m_per_hour(steps):
    """0.1825% of 998.6 hPa is 182.2 Pa; after one time constant the deviation is 93% of it."""
    barometer, count, stream = Barometer(BarometerSettings(white_noise=0.0)), 20_000, generator()
    body, time = at([0.0] * count), seconds(0.0, count)
    state = barometer.start(body, time, stream)
    for _ in range(steps):
        time = time + 3600.0 / steps
        state = barometer.update(state, body, time, stream)
    reading = barometer.read(state, time)
    assert reading.pressure.std().item() == pytest.approx(182.2 * 0.92987, rel=0.02)
