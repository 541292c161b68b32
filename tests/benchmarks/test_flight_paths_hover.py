import math

import pytest

from benchmarks.flight_paths import hover_error
from drone_rl.config import DynamicsSettings


def air(**changes):
    return DynamicsSettings(mode="simple_flight", **changes)


def test_still_air_blows_nowhere():
    error = hover_error(air(), seconds=2.0, num_drones=1)
    assert error.greatest < 1e-3


def test_wind_blows_as_far_as_the_controller_must_lean():
    """It leans by what drags over what it weighs: gains of velocity, then of position, ask for it.

    Leaning it shows the wind a little of its underside, too, so that it is a little more.
    """
    error = hover_error(air(wind=(5.0, 0.0, 0.0)), seconds=20.0, num_drones=1)
    lean = 0.00538 * 1.225 * 25.0 / 9.81
    meters = lean / (0.2 * math.pi / 5.5) / (0.25 * 6.0)
    assert error.mean == pytest.approx(meters, rel=0.05)
    assert error.mean < error.greatest < 0.3


def test_gusts_differ_from_drone_to_drone():
    one = hover_error(air(gusts=2.0), seconds=2.0, num_drones=1)
    other = hover_error(air(gusts=2.0), seconds=2.0, num_drones=1, seed=1)
    assert one != other
