import math

from benchmarks.flight_paths import bench_flight_paths


def test_errors_are_within_their_limits():
    figures = bench_flight_paths(quick=True)
    assert figures["path_error_m"] <= 0.5
    assert figures["hover_error_m"] <= figures["hover_greatest_m"] <= 0.3
    square = figures["path_errors"]["square"]
    assert (square["length"], square["speed"]) == (40.0, 2.0)
    assert square["mean"] == figures["path_error_m"] < square["greatest"]
    assert math.isfinite(square["seconds"])
