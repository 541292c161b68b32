"""Drift from MuJoCo, paths, and hovering in wind."""

import math

import pytest

from benchmarks.flight_parity import measure_parity
from benchmarks.flight_paths import bench_flight_paths, hover_error
from drone_rl.config import DynamicsSettings


def test_both_simulators_agree_for_a_second_of_each_kind():
    gaps = measure_parity(15, seconds=1.0)
    assert len({gap.name for gap in gaps}) == 15
    assert all(0 <= gap.metres < 1e-3 and 0 <= gap.degrees < 0.05 for gap in gaps)


def test_errors_of_the_square_and_of_hovering_are_within_their_limits(setup):
    figures = bench_flight_paths(setup)
    assert figures["path_error_m"] <= 0.5
    assert figures["hover_error_m"] <= figures["hover_greatest_m"] <= 0.3
    assert 4 * 10 / 2 < figures["path_s"] < 60


def test_the_hover_error_follows_from_the_lean_angle():
    """The lean angle is drag over weight; dividing by the two gains gives the position error.

    The measured error is slightly larger, because a leaning drone exposes its underside to the
    wind.
    """
    settings = DynamicsSettings(mode="simple_flight", wind=(5.0, 0.0, 0.0))
    error = hover_error(settings, seconds=20.0)
    lean = 0.00538 * 1.225 * 25.0 / 9.81
    metres = lean / (0.2 * math.pi / 5.5) / (0.25 * 6.0)
    assert error.mean == pytest.approx(metres, rel=0.05)
