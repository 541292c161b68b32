"""Readings of sensors as messages."""

import pytest

from drone_rl.sim.coordinates import HOME
from tests.flight.airsim.flying import make


@pytest.mark.parametrize("kind", ["imu", "barometer", "magnetometer", "gps"])
def test_sensors_answer(kind):
    vehicle = make()
    vehicle.sensor(kind)
    for _ in range(60):
        vehicle.run(vehicle.period)
    found = vehicle.sensor(kind)
    assert found["time_stamp"] > 0
    if kind == "imu":  # at rest the specific force is 1 g up, which is negative in FRD
        assert found["linear_acceleration"]["z_val"] == pytest.approx(-9.81, abs=0.3)
    if kind == "barometer":
        assert found["altitude"] == pytest.approx(HOME.altitude, abs=20.0)
