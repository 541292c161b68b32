"""What the table of figures in flight says, row by row, of which keys of docs/results.json."""

from collections.abc import Sequence

from tools.readme.tables import Figures, Row


def _seconds(values: Sequence[float]) -> str:
    return ", ".join(f"{value:.0f}" for value in values)


def _lower(values: Sequence[float]) -> str:
    return ", ".join(f"{value:.3f}" for value in values)


def _speed(f: Figures) -> str:
    return f"{f['flight_moves_per_s']:,.0f}; {f['flight_over_mujoco_warp']:.0f}"


def _trained(f: Figures, name: str) -> str:
    return f"{_seconds(f[f'{name}_time_to_solve_s'])}; {_lower(f[f'{name}_success_lower95'])}"


FLIGHT = (
    Row(
        "flight_speed",
        "moves a second of 256 drones, 33 ticks of physics and the whole cascade in each; times as "
        "many as MuJoCo Warp makes of the same body without a controller",
        _speed,
        "300,000; 50",
    ),
    Row(
        "flight_speed",
        "one drone with a picture of 144x256 at each command: times real time",
        lambda f: f"{f['flight_realtime_factor']:.0f}",
        "30",
    ),
    Row(
        "flight_speed",
        "frames/s of collecting in flight; over computer-vision mode",
        lambda f: f"{f['flight_collector_fps']:,.0f}; {f['flight_over_cv']:.2f}",
        "0.8",
    ),
    Row(
        "flight_parity",
        "greatest difference to MuJoCo after 10 s of free flight, 100 random manoeuvres: metres; "
        "degrees",
        lambda f: f"{f['flight_parity_m']:.4f}; {f['flight_parity_deg']:.4f}",
        "0.01; 0.5",
    ),
    Row(
        "flight_paths",
        "mean distance, metres, from a square of 10 m at 2 m/s; from its place of a drone that "
        "hovers in wind of 5 m/s",
        lambda f: f"{f['path_error_m']:.2f}; {f['hover_error_m']:.2f}",
        "0.5; 0.3",
    ),
    Row(
        "flight_moves",
        "`experiment=flight`: seconds from the start of the command until solved, five seeds; "
        "lower end of the share of 1,000 flights with all cubes",
        lambda f: _trained(f, "flight"),
        "median 60; 0.95",
    ),
    Row(
        "flight_velocity",
        "`experiment=flight_velocity`, the same, three seeds",
        lambda f: _trained(f, "flight_velocity"),
        "300; 0.95",
    ),
    Row(
        "flight_pillars",
        "`experiment=flight_pillars`, the same of flights that touch no pillar, three seeds",
        lambda f: _trained(f, "flight_pillars"),
        "0.9",
    ),
)
"""Drones with a body."""
