"""Readings of sensors as messages."""

import pytest

from drone_rl.flight.airsim.methods import METHODS
from drone_rl.flight.airsim.vehicle import RECENT
from drone_rl.sim.coordinates import HOME, GeoPoint
from tests.flight.airsim.flying import fly, make


def sensor(vehicle, kind):
    return METHODS[f"get{kind}Data"].compute(None, "", vehicle)


@pytest.mark.parametrize("kind", ["Imu", "Barometer", "Magnetometer", "Gps"])
def test_sensors_answer(kind):
    vehicle = make()
    sensor(vehicle, kind)
    for _ in range(60):
        vehicle.run(vehicle.period)
    found = sensor(vehicle, kind)
    assert found["time_stamp"] > 0
    if kind == "Imu":  # at rest the specific force is 1 g up, which is negative in FRD
        assert found["linear_acceleration"]["z_val"] == pytest.approx(-9.81, abs=0.3)
    if kind == "Barometer":
        assert found["altitude"] == pytest.approx(HOME.altitude, abs=20.0)


def test_gps_knows_the_place_of_a_drone_that_has_flown_before_its_first_reading():
    """It has had its fix for long; the readings are 0.2 s old."""
    vehicle = make()
    assert not sensor(vehicle, "Gps")["is_valid"]
    vehicle.reset()
    vehicle.enable_api_control(True)
    fly(vehicle, vehicle.take_off())
    for _ in range(60):
        vehicle.run(vehicle.period)
    found = sensor(vehicle, "Gps")
    place = vehicle.geo_point()
    assert found["is_valid"]
    assert found["gnss"]["geo_point"]["latitude"] == pytest.approx(place["latitude"], abs=1e-4)
    assert found["gnss"]["geo_point"]["altitude"] == pytest.approx(place["altitude"], abs=10.0)


def test_a_drone_at_rest_feels_its_weight_after_a_silence_of_any_length():
    for periods in (1, RECENT - 1, RECENT, RECENT + 1, 100):
        vehicle = make()
        for _ in range(periods):
            vehicle.run(vehicle.period)
        down = sensor(vehicle, "Imu")["linear_acceleration"]["z_val"]
        assert down == pytest.approx(-9.81, abs=0.5)
        seconds = periods * vehicle.period * vehicle.settings.tick
        assert vehicle.sensors.time == pytest.approx(seconds)


def test_gps_counts_from_the_origin_of_the_settings():
    north = GeoPoint(60.0, 10.0, 0.0)
    vehicle = make(home=north)
    for _ in range(100):
        vehicle.run(vehicle.period)
    found = sensor(vehicle, "Gps")["gnss"]["geo_point"]
    assert (found["latitude"], found["longitude"]) == pytest.approx((60.0, 10.0), abs=1e-3)
