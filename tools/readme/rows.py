"""Rows of the tables of figures in README.md and docs/results.md."""

import statistics
from functools import partial

from tools.readme.tables import Figures, Row


def _peer_seconds(figures: Figures) -> str:
    names = ("reinforce", "ppo", "sb3_ppo", "sb3_a2c", "torchrl")
    means = [statistics.mean(figures["peers"][name]["seconds"]) for name in names]
    return "; ".join(f"{seconds:.1f}" for seconds in means)


def _solved(key: str, figures: Figures) -> str:
    solved = figures[key].values()
    return "; ".join("not solved" if one is None else f"{one:.0f}" for one in solved)


HEADLINES = (
    Row(
        "solve",
        "Seconds to train the chapter's task, start-up included, median of 5 seeds",
        "{time_to_solve_s.median:.1f}",
    ),
    Row(
        "gamed",
        "Policies built to deceive `verdict` that it called good or proved",
        "{gamed_verdicts} of {gamed_total}",
    ),
    Row(
        "maps",
        "Heat maps that ignore the policy (such as noise) but pass the tests",
        "{placebo_maps_trusted} of {placebo_maps_total}",
    ),
)
"""The headline figures of README.md: three that need no legend."""
MAIN = (
    Row(
        "solve",
        "seconds from the start of `drone-rl train` to a running mean of 2.97 of 3 cubes, 5 seeds",
        "{time_to_solve_s.min:.0f} to {time_to_solve_s.max:.0f}, median "
        "{time_to_solve_s.median:.0f}",
        "60",
    ),
    Row("solve", "seeds of 5 that reach this mean", "{seeds_solved}", "5"),
    Row(
        "solve",
        "success rate in 1,000 held-out episodes, lower end of the exact 95% CI, worst of 5 seeds",
        "{success_lower95.min:%}",
        "95%",
    ),
    Row(
        "seeds",
        "20 other seeds: number that reach this mean; worst lower end of the 95% CI",
        "{seeds_solved_of_20}; {seeds_lower95.min:%}",
        "20",
    ),
    Row(
        "imitation",
        "policies cloned from 30 flights of the oracle, success rate in 1,000 held-out episodes, "
        "3 seeds",
        "{imitation_success:%}",
        "80%",
    ),
    Row(
        "imitation",
        "the same after REINFORCE, and the frames that it collected",
        "{imitation_reinforce_success:%}; {imitation_reinforce_frames:,} frames",
        "95%",
    ),
    Row(
        "solve",
        "training frames/s, collection and learning together",
        "{learning_fps:,.0f}",
        "16,000",
    ),
    Row(
        "large",
        "the same with images of 100x256 (`experiment=large`)",
        "{learning_fps_large:,.0f}",
        "2,440",
    ),
    Row(
        "render",
        "rendering at 25x64, frames/s; ratio to MuJoCo Warp's renderer at 25x64, 64x64, 100x256",
        "{raw_render_fps:,.0f}; {render_over_warp:.1f} times",
        "-",
    ),
    Row(
        "render",
        "rendering at 64x64, frames/s",
        "{raw_render_fps_64:,.0f}",
        "70,000",
    ),
    Row(
        "render",
        "the same with `appearance=blocks`: 30 geoms, textures, shadows, fog",
        "{raw_render_blocks_fps_64:,.0f}",
        "25,000",
    ),
    Row(
        "render",
        "time of RGB, gray, depth, distance, segmentation and normals in one pass, relative to RGB",
        "{render_all_over_rgb:.2f}",
        "at most 1.6",
    ),
    Row(
        "collector",
        "frames/s of the collector with a policy, relative to rendering only by MuJoCo Warp, 25x64",
        "{collector_over_raw:.2f} ({collector_fps:,.0f} over "
        "{raw_render_beside_collector_fps:,.0f})",
        "0.7",
    ),
    Row(
        "collector",
        "frames/s of the collector with a policy, best number of environments; 16 environments",
        "{collector_fps:,.0f} ({collector_worlds} environments); {collector_fps_16:,.0f}",
        "40,000; 15,000",
    ),
    Row(
        "dm_control",
        "frames/s of the batched environment relative to dm_control with EGL, default quality",
        "{batched_over_dm_control:.0f} times ({dm_control_fps:.0f} frames/s)",
        "100 times",
    ),
    Row(
        "dm_control",
        "the same with dm_control's quality tuned manually",
        "{batched_over_dm_control_tuned:.1f} times ({dm_control_tuned_fps:.0f} frames/s)",
        "1.5 times",
    ),
    Row("memory", "peak memory of the default training", "{peak_memory_mib:.0f} MiB", "1,024 MiB"),
    Row(
        "memory",
        "memory growth over 1,000,000 frames after the first 100,000",
        "{memory_growth_mib_per_million_frames:z.1f} MiB",
        "5 MiB",
    ),
    Row(
        "startup",
        "time from the start of `drone-rl train` to its first update, kernels cached",
        "{start_to_first_update_s:.1f} s with {import_torch_s:.1f} s for `import torch`",
        "4 s",
    ),
    Row(
        "startup",
        "time of `drone-rl verdict policy=good`, 400 episodes",
        "{verdict_s:.1f} s",
        "6 s",
    ),
    Row(
        "startup",
        "additional time if kernels must be compiled",
        "{first_compile_s:.0f} s",
        "15 s",
    ),
    Row("startup", "time of `import drone_rl`", "{import_s:two digits} s", "0.3 s"),
    Row(
        "explain",
        "time of t-SNE with 600 frames; 10,000 frames",
        "{tsne_600_s:two digits} s; {tsne_10000_s:two digits} s",
        "5 s; 60 s",
    ),
    Row(
        "explain",
        "time of a response map, 41 x 31 positions",
        "{response_map_s:two digits} s",
        "3 s",
    ),
    Row(
        "explain",
        "action probability of class models, policy good (forward, left, right)",
        "{class_model_probability:.3f}",
        "0.99",
    ),
    Row(
        "original",
        "`experiment=original`, best of six settings: seeds of 5 that reach 2.99 of 3",
        "{original_solved} ({original_best})",
        "4",
    ),
    Row(
        "chapter",
        "its time for 30,000 episodes, minutes",
        "{original_minutes:.1f}",
        "15",
    ),
    Row(
        "chapter",
        "success rate on a task that needs memory (`examples/recall.py`), an LSTM; no memory",
        "{lstm_success:%}; {memoryless_success:%}",
        "90%; at most 60%",
    ),
    Row("explain", "size of report.html", "{report_mib:.1f} MiB", "10 MB"),
    Row(
        "sweeps",
        "training runs per hour in a sweep, two parallel runs relative to one",
        "{sweep_speedup:.2f} times",
        "1.6 times",
    ),
    Row(
        "kills",
        "runs with bit-identical results in a sweep that was killed three times",
        "{sweep_runs_same_after_kills} of {sweep_runs}",
        "all",
    ),
)
"""Training, rendering and sweeps."""
ADVERSARIAL = (
    Row(
        "coverage",
        "smallest coverage of all displayed 95% intervals, by enumeration and simulation",
        "{interval_coverage_min:%}",
        "94.5%",
    ),
    Row(
        "coverage",
        "rate of certain but wrong verdicts, greatest of the simulated policies near the "
        "thresholds",
        "{false_certain_rate:%}",
        "at most 5%",
    ),
    Row(
        "maps",
        "saliency maps independent of the policy that are trusted",
        "{placebo_maps_trusted} of {placebo_maps_total}",
        "0",
    ),
    Row(
        "maps",
        "networks with a known map: how many; fraction whose true map is trusted",
        "{planted_maps_total}; {planted_maps_found:%}",
        "90%",
    ),
    Row(
        "verdicts",
        "certain verdicts that agree with 5,000 other episodes",
        "{verdicts_right} of {verdicts_certain} certain, {verdicts_total} in total",
        "all",
    ),
    Row(
        "gamed",
        "adversarial policies judged good and certain, or proved",
        "{gamed_verdicts} of {gamed_total}",
        "0",
    ),
    Row(
        "adversaries",
        "policies that act by rounding, sweep blindly or fail within a range: most fresh seeds of "
        "one that is judged good and certain, or its range accepted; rate of all",
        "{adversaries_most} of {adversaries_seeds}; {adversaries_rate:%}",
        "1 of 20; 3%",
    ),
    Row(
        "fragile_honest",
        'honest policies, bundled or trained by default, "not certain" when episodes are repeated',
        "{fragile_honest} of {fragile_honest_total}",
        "0",
    ),
    Row(
        "domain_axes",
        "axes on which the range that was found is accepted, and bad values are refused",
        "{domain_axes_right} of {domain_axes}",
        "all",
    ),
    Row(
        "render_truth",
        "images of random scenes compared with OpenGL: pixels off edges with another geom",
        "{render_truth_inner_wrong} in {render_truth_scenes} scenes",
        "0",
    ),
    Row(
        "render_truth",
        "the same: geoms of more than 30 pixels with IoU of at least 0.98; smallest IoU",
        "{render_truth_overlapping} of {render_truth_geoms}; {render_truth_least_overlap:.3f}",
        "all",
    ),
    Row(
        "render_truth",
        "the same: greatest difference of depth; of color, levels of 255",
        "{render_truth_depth_mm:.2f} mm; {render_truth_rgb}",
        "1 mm; 2",
    ),
    Row(
        "shifts",
        "seconds to evaluate a policy under ten groups of perturbations, five strengths each, 200 "
        "episodes",
        "{shift_suite_s:.0f} with {shift_suite_axes} axes",
        "480",
    ),
    Row(
        "shifts",
        "mean area under the curve of success rate over strength, policy good",
        "{shift_area:.2f}",
    ),
    Row(
        "robust",
        "gain of `experiment=robust` over the default in success rate, percentage points, 3 seeds: "
        "under groups of perturbations without randomization in training",
        "{robust_gain_points:+.1f} of at most {robust_room_points:.1f}",
        "+15",
    ),
    Row(
        "robust",
        "the same under all groups; loss under training conditions",
        "{robust_gain_all_kinds_points:+.1f}; {robust_cost_points:z.1f}",
        "-; at most 1",
    ),
    Row(
        "explain",
        "time and memory of `drone-rl explain policy=good`, 600 frames, with the report",
        "{explain_s:.0f} s, {explain_peak_memory_mib:,.0f} MiB",
        "120 s, 2,048 MiB",
    ),
)
"""Attempts to make the program claim something false."""
VERIFICATION = (
    Row(
        "prove",
        "fraction of all placements from which the default policy fails, exact, 5 seeds",
        "{proof_lost:%}",
    ),
    Row(
        "prove",
        "greatest undecided fraction of these proofs",
        "{proof_undecided:%}",
        "0.0001%",
    ),
    Row(
        "prove",
        "seconds of these proofs",
        "{proof_three_s:.0f}",
        "240",
    ),
    Row(
        "prove",
        "seconds of a proof with two cubes, policy good",
        "{proof_two_s:.1f}",
        "4",
    ),
    Row(
        "prove",
        "simulated episodes that end differently than proved",
        "{proof_contradicted} of {proof_flights:,}",
        "0",
    ),
    Row(
        "prove",
        "certificates that the independent checker accepts",
        "{proof_checked} of {proof_checked_total}",
        "all",
    ),
    Row(
        "provable",
        "minutes until `experiment=provable` is proved, 3 seeds",
        "{provable_s:minutes}",
        "30",
    ),
    Row(
        "exact_coverage",
        "fraction of verdict intervals that contain the exact success rate",
        "{verdict_coverage_exact:%}",
        "94.5%",
    ),
)
"""Verification."""
FLIGHT = (
    Row(
        "fly_page",
        "page to fly from: images of 256x144 displayed per second in Chromium, without a GPU",
        "{fly_page_fps:.0f}",
        "30",
    ),
    Row(
        "airsim",
        "server for AirSim's clients: round trips per second for an image of 144x256, for a pose; "
        "simulated over real seconds in lockstep; seconds until it is ready",
        "{airsim_images_per_s:,.0f}; {airsim_calls_per_s:,.0f}; {airsim_lockstep_factor:,.0f}; "
        "{airsim_ready_s:.1f}",
        "400; 4,000; 100; 5",
    ),
    Row(
        "airsim",
        "methods of the multirotor client 1.8.1 that work, wholly or partly, of those that need no "
        "lidar, distance sensor, car or Unreal; crafted messages survived; "
        "growth over an hour of simulated traffic, MiB; two runs in lockstep are the same",
        "{airsim_methods_share:%}; {airsim_fuzz_survived:,}; {airsim_growth_mib:.1f}; "
        "{airsim_lockstep_repeats}",
        "95%; 100,000; 5; yes",
    ),
    Row(
        "airsim",
        "the chapter's program for AirSim 1.1: mean cubes of 3 over 20 resets, collected by an "
        "oracle that sees images only, with the default clock, in lockstep, in computer-vision "
        "mode; trained through the client: success rate, lower end of the 95% CI; minutes",
        "{airsim_chapter_cubes:.2f}; {airsim_chapter_lower95:%}; {airsim_chapter_minutes:.0f}",
        "2.9 each; 90%; 20",
    ),
    Row(
        "airsim",
        "kinds of AirSim programs whose numbers are right through every client that has their "
        "calls (1.1.7, 1.2.8, 1.8.1, cosysairsim 3.5); simulated seconds after 200 continues of "
        "0.01 s, and of 0.05 s",
        "{airsim_scripts_right} of {airsim_scripts}; {airsim_continue_s:.2f}",
        "all; 2.0, 10.0",
    ),
    Row(
        "flight_speed",
        "environment steps per second of 256 drones (33 physics steps with all controllers each); "
        "ratio to MuJoCo Warp with the same body and no controller",
        "{flight_moves_per_s:,.0f}; {flight_over_mujoco_warp:.0f}",
        "300,000; 50",
    ),
    Row(
        "flight_speed",
        "real-time factor of one drone with an image of 144x256 per command",
        "{flight_realtime_factor:.0f}",
        "30",
    ),
    Row(
        "flight_speed",
        "frames/s of the collector with vehicle dynamics; ratio to computer-vision mode",
        "{flight_collector_fps:,.0f}; {flight_over_cv:.2f}",
        "0.8",
    ),
    Row(
        "flight_parity",
        "greatest difference to MuJoCo after 10 s of free flight, 100 random maneuvers: m; degrees",
        "{flight_parity_m:.4f}; {flight_parity_deg:.4f}",
        "0.01; 0.5",
    ),
    Row(
        "flight_paths",
        "mean distance, m, to a square path of 10 m at 2 m/s; to the hover position in wind of "
        "5 m/s",
        "{path_error_m:.2f}; {hover_error_m:.2f}",
        "0.5; 0.3",
    ),
    Row(
        "presets",
        "`experiment=flight`: seconds from the start of the command until solved, 5 seeds; success "
        "rate in 1,000 episodes, lower end of the exact 95% CI",
        "{flight_time_to_solve_s:.0f}; {flight_success_lower95:%}",
        "median 60; 95%",
    ),
    Row(
        "presets",
        "the same for `experiment=flight_velocity`, 3 seeds",
        "{flight_velocity_time_to_solve_s:.0f}; {flight_velocity_success_lower95:%}",
        "300; 95%",
    ),
    Row(
        "presets",
        "the same for `experiment=flight_pillars`, 3 seeds",
        "{flight_pillars_time_to_solve_s:.0f}; {flight_pillars_success_lower95:%}",
        "90%",
    ),
)
"""Vehicle dynamics."""
LIBRARIES = (
    Row(
        "peers",
        "seconds from process start until solved, mean of 3 seeds: our default; our PPO; "
        "Stable-Baselines3's PPO; its A2C; TorchRL's collector",
        _peer_seconds,
        "ours lowest",
    ),
    Row(
        "peers",
        "ratio of our default's seconds to those of the fastest other library",
        "{solve_over_best_peer:.2f}",
        "0.6",
    ),
    Row(
        "gymnasium",
        "frames/s of the Gymnasium vector environment relative to the batched environment",
        "{gym_over_batched:.2f} ({gym_fps:,.0f} frames/s)",
        "0.8",
    ),
    Row(
        "presets",
        "task pillars: success rate in 1,000 held-out episodes, lower end of the exact 95% CI, "
        "3 seeds",
        "{pillars_success_lower95:%}",
        "95%",
    ),
    Row(
        "presets",
        "minutes to train each seed, from the start of the command",
        "{pillars_time_to_solve_s:minutes}",
        "5",
    ),
    Row(
        "onnx",
        "greatest difference of a probability between the bundled policies and their ONNX models",
        "{onnx_max_difference:.1e} on {onnx_frames:,} images",
        "1e-05",
    ),
    Row(
        "onnx",
        "images with a different most probable action",
        "{onnx_actions_differ} of {onnx_frames:,}",
        "0",
    ),
)
"""Other libraries."""
TASKS = (
    Row(
        "tasks",
        "a user's reward term: lines; rate of fused collecting with it over that without; seconds "
        "from an edit to the first update",
        "{reward_term_lines}; {reward_term_ratio:.2f}; {reward_term_s:.0f}",
        "8; 0.9; 20",
    ),
    Row(
        "tasks",
        "a user's task, reach a ball among boxes: lines; commands that work on it",
        "{own_task_lines}; {own_task_commands}",
        "40; 11",
    ),
    Row(
        "tasks",
        "success rate of its trained policies in a verdict, lower end of the 95% CI, worst of 3 "
        "seeds; most seconds from the start of the training to the verdict",
        "{own_task_lower95:%}; {own_task_s:.0f}",
        "90%; 120",
    ),
    Row(
        "tasks",
        "`explain` on it, seconds; heat maps of placebos that are trusted; planted ones that are "
        "found",
        "{own_task_explain_s:.0f}; {own_task_placebos_trusted} of {own_task_placebos_total}; "
        "{own_task_planted_found:%}",
        "60; 0; 90%",
    ),
    Row(
        "tasks",
        "search over two weights of its reward: success of the best trial, and of the one with the "
        "largest running reward",
        "{search_success:%}; {search_by_reward:%}",
        "95%; below 50%",
    ),
)
"""Tasks that users define."""
INPUTS = (
    Row(
        "presets",
        "`experiment=flight`, `pillars`, `flight_velocity`, `flight_pillars`, `robust`: seconds "
        "from the start of the command until solved, median of 3 seeds (5 of `flight`)",
        partial(_solved, "inputs_solve_s"),
        "60; 15; 20; 90; 60",
    ),
    Row(
        "goal",
        "a user's task, a goal behind boxes, by moves that turn: success rate with image, goal and "
        "last action, lower end of the 95% CI, worst of 3 seeds; without the image; most seconds",
        "{goal_lower95:%}; {goal_blind:%}; {goal_s:.0f}",
        "85%; 30%; 400",
    ),
    Row(
        "goal_flight",
        "the same with depth, goal and velocity, flown by velocities",
        "{goal_flight_lower95:%}; {goal_flight_blind:%}; {goal_flight_s:.0f}",
        "85%; 30%; 900",
    ),
    Row(
        "input_rates",
        "rate of collecting 64x64 depth and a goal over 64x64 gray; of two stacked frames over "
        "one; of velocities over moves",
        "{inputs_over_gray:.2f}; {stack_over_one:.2f}; {velocity_over_moves:.2f}",
        "0.7; 0.8; 0.3",
    ),
    Row(
        "inputs",
        "a policy of three inputs, `policy.act` and ONNX: largest difference; actions that differ",
        "{inputs_onnx_difference:.1e}; {inputs_onnx_differ}",
        "1e-05; 0",
    ),
    Row(
        "inputs",
        "policies that ignore an input, and are said to; verdicts on one that uses its inputs and "
        "is said to ignore one",
        "{ignored_input_found} of {ignored_input_tried}; {ignored_input_false} of 20",
        "38; 1",
    ),
    Row(
        "inputs",
        "placebo vectors that are called important",
        "{placebo_vectors} of {placebo_vectors_tried}",
        "0",
    ),
)
"""Policies with several inputs, and presets."""
WORLDS = (
    Row(
        "world_drawing",
        "frames/s at 64x64 in the indoor scene relative to MuJoCo Warp's renderer; to MuJoCo's "
        "OpenGL without shadows and multisampling",
        "{world_over_warp:.1f} times; {world_over_opengl:.1f} times",
        "4; 6",
    ),
    Row(
        "world_drawing",
        "frames/s of collecting with a policy there relative to MuJoCo Warp's renderer alone",
        "{world_collecting_over_warp:.1f} times",
        "3",
    ),
    Row(
        "world_hostile",
        "hostile scene files that run code, reveal a file, or take over 2 GiB or 20 s",
        "{world_hostile:d} of {world_hostile_total:d}",
        "0",
    ),
    Row(
        "world_contacts",
        "largest error of distances to what is solid, 1,000 points in each of six scenes",
        "{contact_error_mm:.4f} mm",
        "1 mm",
    ),
    Row(
        "world_training",
        "`reach` indoors, by moves and in flight: seconds until a verdict's success is 90% (median "
        "of 3 seeds)",
        partial(_solved, "world_solve_s"),
        "600; 1800",
    ),
    Row(
        "world_training",
        "the same: success rate, lower end of the 95% CI, worst seed; success of policies that "
        "learned without the image",
        "{world_lower95:%}; {world_blind:%}",
        "85%; 30%",
    ),
    Row(
        "world_commands",
        "commands and libraries that work on a new scene without Python",
        "{world_commands} of {world_commands_total}",
        "all",
    ),
    Row(
        "world_judging",
        "seconds of `verdict`, `explain`, and `shifts` of one axis, default episodes",
        "{world_verdict_s:.0f}; {world_explain_s:.0f}; {world_shifts_s:.0f}",
        "120; 180; 150",
    ),
    Row(
        "world_judging",
        "heat maps of placebos that are trusted; planted ones that are found",
        "{world_placebos_trusted} of {world_placebos_total}; {world_planted_found:%}",
        "0; 90%",
    ),
    Row(
        "world_strangers",
        "scene files of dm_control, Gymnasium, MuJoCo and MuJoCo Warp, and the fraction that looks "
        "as in MuJoCo's OpenGL; pixels that show another geom; with gray within 8 of 255",
        "{world_strangers}: {world_strangers_right:.0%}; {world_strangers_geoms:.2%}; "
        "{world_strangers_gray:.1%}",
        "40; 1%; 95%",
    ),
)
"""Scenes from files."""
