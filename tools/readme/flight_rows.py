"""Rows of the table of figures for vehicle dynamics."""

from collections.abc import Sequence

from tools.readme.tables import Figures, Row, percent


def _seconds(values: Sequence[float]) -> str:
    return ", ".join(f"{value:.0f}" for value in values)


def _lower(values: Sequence[float]) -> str:
    return ", ".join(map(percent, values))


def _speed(f: Figures) -> str:
    return f"{f['flight_moves_per_s']:,.0f}; {f['flight_over_mujoco_warp']:.0f}"


def _trained(f: Figures, name: str) -> str:
    return f"{_seconds(f[f'{name}_time_to_solve_s'])}; {_lower(f[f'{name}_success_lower95'])}"


FLIGHT = (
    Row(
        "fly_page",
        "page to fly from: images of 256x144 displayed per second in Chromium, without a GPU",
        lambda f: f"{f['fly_page_fps']:.0f}",
        "30",
    ),
    Row(
        "airsim",
        "server for AirSim's clients: round trips per second for an image of 144x256, for a pose; "
        "simulated over real seconds in lockstep; seconds until it is ready",
        lambda f: (
            f"{f['airsim_images_per_s']:,.0f}; {f['airsim_calls_per_s']:,.0f}; "
            f"{f['airsim_lockstep_factor']:,.0f}; {f['airsim_ready_s']:.1f}"
        ),
        "400; 4,000; 100; 5",
    ),
    Row(
        "airsim",
        "methods of the multirotor client 1.8.1 that work, wholly or partly, of those that need no "
        "lidar, distance sensor, car or Unreal; crafted messages survived; "
        "growth over an hour of simulated traffic, MiB; two runs in lockstep are the same",
        lambda f: (
            f"{percent(f['airsim_methods_share'])}; {f['airsim_fuzz_survived']:,}; "
            f"{f['airsim_growth_mib']:.1f}; {'yes' if f['airsim_lockstep_repeats'] else 'no'}"
        ),
        "95%; 100,000; 5; yes",
    ),
    Row(
        "airsim",
        "kinds of AirSim programs whose numbers are right through every client that has their "
        "calls (1.1.7, 1.2.8, 1.8.1, cosysairsim 3.5); simulated seconds after 200 continues of "
        "0.01 s, and of 0.05 s",
        lambda f: (
            f"{f['airsim_scripts_right']} of {f['airsim_scripts']}; "
            f"{', '.join(f'{seconds:.2f}' for seconds in f['airsim_continue_s'])}"
        ),
        "all; 2.0, 10.0",
    ),
    Row(
        "airsim",
        "the chapter's program for AirSim 1.1: mean cubes of 3 over 20 resets, collected by an "
        "oracle that sees images only, with the default clock, in lockstep, in computer-vision "
        "mode; trained through the client: success rate, lower end of the 95% CI; minutes",
        lambda f: (
            f"{', '.join(f'{cubes:.2f}' for cubes in f['airsim_chapter_cubes'])}; "
            f"{percent(f['airsim_chapter_lower95'])}; {f['airsim_chapter_minutes']:.0f}"
        ),
        "2.9 each; 90%; 20",
    ),
    Row(
        "flight_speed",
        "environment steps per second of 256 drones (33 physics steps with all controllers each); "
        "ratio to MuJoCo Warp with the same body and no controller",
        _speed,
        "300,000; 50",
    ),
    Row(
        "flight_speed",
        "real-time factor of one drone with an image of 144x256 per command",
        lambda f: f"{f['flight_realtime_factor']:.0f}",
        "30",
    ),
    Row(
        "flight_speed",
        "frames/s of the collector with vehicle dynamics; ratio to computer-vision mode",
        lambda f: f"{f['flight_collector_fps']:,.0f}; {f['flight_over_cv']:.2f}",
        "0.8",
    ),
    Row(
        "flight_parity",
        "greatest difference to MuJoCo after 10 s of free flight, 100 random maneuvers: m; degrees",
        lambda f: f"{f['flight_parity_m']:.4f}; {f['flight_parity_deg']:.4f}",
        "0.01; 0.5",
    ),
    Row(
        "flight_paths",
        "mean distance, m, to a square path of 10 m at 2 m/s; to the hover position in wind of "
        "5 m/s",
        lambda f: f"{f['path_error_m']:.2f}; {f['hover_error_m']:.2f}",
        "0.5; 0.3",
    ),
    Row(
        "flight_moves",
        "`experiment=flight`: seconds from the start of the command until solved, 5 seeds; success "
        "rate in 1,000 episodes, lower end of the exact 95% CI",
        lambda f: _trained(f, "flight"),
        "median 60; 95%",
    ),
    Row(
        "flight_velocity",
        "the same for `experiment=flight_velocity`, 3 seeds",
        lambda f: _trained(f, "flight_velocity"),
        "300; 95%",
    ),
    Row(
        "flight_pillars",
        "the same for `experiment=flight_pillars`, 3 seeds",
        lambda f: _trained(f, "flight_pillars"),
        "90%",
    ),
)
"""Vehicle dynamics."""
