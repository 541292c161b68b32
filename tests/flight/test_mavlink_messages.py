import math

import numpy as np
import pytest

from drone_rl.flight.in_the_loop.instruments import Readings
from drone_rl.flight.mavlink import FIELD, gps_fields, rotor_outputs, sensor_fields
from drone_rl.sim.coordinates import GeoPoint

HALF = math.sqrt(0.5)
READINGS = Readings(
    time=1.25,
    position=np.array([0.0, 0.0, 2.5]),
    velocity=np.array([3.0, -4.0, 0.5]),  # 3 m/s north, 4 east, half up
    attitude=np.array([1.0, 0.0, 0.0, 0.0]),
    rates=np.array([0.1, 0.2, 0.3]),
    force=np.array([1.0, 2.0, 9.0]),
    home=GeoPoint(48.0, 11.0, 100.0),
)


def test_what_is_sensed_is_forward_right_down():
    fields = sensor_fields(READINGS)
    assert [fields[f"{a}acc"] for a in "xyz"] == [1.0, -2.0, -9.0]
    assert [fields[f"{a}gyro"] for a in "xyz"] == [0.1, -0.2, -0.3]
    assert fields["time_usec"] == 1_250_000
    assert fields["pressure_alt"] == 102.5
    assert fields["abs_pressure"] == pytest.approx(1000.99, abs=0.05)


def test_the_field_turns_against_the_drone():
    assert [sensor_fields(READINGS)[f"{a}mag"] for a in "xyz"] == pytest.approx(FIELD)
    west = Readings(**{**vars(READINGS), "attitude": np.array([HALF, 0.0, 0.0, HALF])})
    fields = sensor_fields(west)  # north is on its right, and what was east is behind it
    assert [fields[f"{a}mag"] for a in "xyz"] == pytest.approx([-FIELD[1], FIELD[0], FIELD[2]])


def test_gps():
    fields = gps_fields(READINGS)
    assert (fields["lat"], fields["lon"], fields["alt"]) == (480_000_000, 110_000_000, 102_500)
    assert (fields["vn"], fields["ve"], fields["vd"]) == (300, 400, -50)
    assert fields["vel"] == 500
    assert fields["cog"] == 5313  # atan2(4, 3)


def test_speeds_that_no_field_holds_are_the_greatest_that_do():
    fast = Readings(**{**vars(READINGS), "velocity": np.array([1e4, 1e4, 1e4])})
    fields = gps_fields(fast)
    assert (fields["vn"], fields["ve"], fields["vd"], fields["vel"]) == (
        32767,
        -32768,
        -32768,
        65534,
    )


def test_rotors():
    controls = [0.1, 2.0, -1.0, math.nan, *[0.5] * 12]
    assert rotor_outputs(controls, 128).tolist() == [0.1, 1.0, 0.0, 0.0]
    assert rotor_outputs(controls, 0).tolist() == [0.0] * 4


def test_constants_of_the_messages():
    """Thirteen fields are new: three each of force, rates and field, and four of the air."""
    fields = sensor_fields(READINGS)
    assert fields["fields_updated"] == 2**13 - 1
    assert (fields["temperature"], fields["diff_pressure"]) == (15.0, 0.0)
    assert FIELD == (0.1795, 0.0490, 0.4903)
    place = gps_fields(READINGS)
    assert (place["fix_type"], place["satellites_visible"]) == (3, 12)
    assert (place["eph"], place["epv"]) == (100, 100)
