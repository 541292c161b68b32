"""Rows of the tables of figures for training, adversarial tests and verification."""

import statistics
from collections.abc import Sequence

from tools.readme.tables import Figures, Row, percent, seconds


def _times(f: Figures) -> str:
    times = f["time_to_solve_s"]
    return f"{min(times):.0f} to {max(times):.0f}, median {statistics.median(times):.0f}"


def _rates(f: Figures) -> str:
    collected, rendered = f["collector_fps"], f["raw_render_beside_collector_fps"]
    return f"{f['collector_over_raw']:.2f} ({collected:,.0f} over {rendered:,.0f})"


def _rendering(f: Figures) -> str:
    ratios = "; ".join(f"{ratio:.1f}" for ratio in f["render_over_warp"].values())
    return f"{f['raw_render_fps']:,.0f}; {ratios} times"


def _class_models(f: Figures) -> str:
    return ", ".join(f"{p:.3f}" for p in f["class_model_probability"])


def _verdicts(f: Figures) -> str:
    right, certain, total = (f[f"verdicts_{name}"] for name in ("right", "certain", "total"))
    return f"{right} of {certain} certain, {total} in total"


def _known_maps(f: Figures) -> str:
    rate, total = f["planted_maps_found"], f["planted_maps_total"]
    return f"{rate * total:.0f} of {total}"


def _imitated(f: Figures) -> str:
    rates, frames = f["imitation_reinforce_success"], f["imitation_reinforce_frames"]
    return f"{', '.join(map(percent, rates))}; {', '.join(f'{n:,}' for n in frames)} frames"


def _seconds(values: Sequence[float]) -> str:
    return ", ".join(f"{value:.0f}" for value in values)


def _slower(f: Figures) -> str:
    """Describe the machine relative to the one of the targets, by how the seconds were scaled."""
    return f"on a machine {f['proof_two_s'] / f['proof_two_scaled_s']:.1f} times slower"


TRUTH = (
    Row(
        "coverage",
        "smallest coverage of all displayed 95% intervals, by enumeration and simulation",
        lambda f: percent(f["interval_coverage_min"]),
        "94.5%",
    ),
    Row(
        "coverage",
        "rate of certain but wrong verdicts, greatest of the simulated policies near the "
        "thresholds; number of these policies",
        lambda f: f"{percent(f['false_certain_rate'])}; {len({r['policy'] for r in f['certain']})}",
        "at most 5%",
    ),
    Row(
        "maps",
        "saliency maps independent of the policy that are trusted",
        lambda f: f"{f['placebo_maps_trusted']} of {f['placebo_maps_total']}",
        "0",
    ),
    Row("maps", "networks with a known map whose true map is trusted", _known_maps, "90%"),
    Row(
        "verdicts",
        "certain verdicts that agree with 5,000 other episodes",
        _verdicts,
        "all",
    ),
    Row(
        "gamed",
        "adversarial policies judged good and certain, or proved",
        lambda f: f"{f['gamed_verdicts']} of {f['gamed_total']}",
        "0",
    ),
    Row(
        "fragile_honest",
        'honest policies, bundled or trained by default, "not certain" because of rounding',
        lambda f: f"{f['fragile_honest']} of {f['fragile_honest_total']}",
        "0",
    ),
    Row(
        "domain_axes",
        "axes whose operating domain is enforced in the right direction, from file to verdict",
        lambda f: f"{f['domain_axes_right']} of {f['domain_axes']}",
        "all",
    ),
    Row(
        "render_truth",
        "images of random scenes compared with OpenGL: pixels off edges with another geom",
        lambda f: f"{f['render_truth_inner_wrong']} in {f['render_truth_scenes']} scenes",
        "0",
    ),
    Row(
        "render_truth",
        "the same: geoms of more than 30 pixels with IoU of at least 0.98; smallest IoU",
        lambda f: (
            f"{f['render_truth_overlapping']} of {f['render_truth_geoms']}; "
            f"{f['render_truth_least_overlap']:.3f}"
        ),
        "all",
    ),
    Row(
        "render_truth",
        "the same: greatest difference of depth; of color, levels of 255",
        lambda f: f"{f['render_truth_depth_mm']:.2f} mm; {f['render_truth_rgb']}",
        "1 mm; 2",
    ),
    Row(
        "shifts",
        "seconds to evaluate a policy under ten groups of perturbations, five strengths each, 200 "
        "episodes",
        lambda f: f"{f['shift_suite_s']:.0f} with {f['shift_suite_axes']} axes",
        "480",
    ),
    Row(
        "shifts",
        "mean area under the curve of success rate over strength, policy good",
        lambda f: f"{f['shift_area']:.2f}",
    ),
    Row(
        "robust",
        "gain of `experiment=robust` over the default in success rate, percentage points, 3 seeds: "
        "under groups of perturbations without randomization in training",
        lambda f: f"{f['robust_gain_points']:+.1f} of at most {f['robust_room_points']:.1f}",
        "+15",
    ),
    Row(
        "robust",
        "the same under all groups; loss under training conditions",
        lambda f: (
            f"{f['robust_gain_all_kinds_points']:+.1f}; "
            f"{round(f['robust_cost_points'], 1) + 0.0:.1f}"
        ),
        "-; at most 1",
    ),
    Row(
        "explain",
        "time and memory of `drone-rl explain policy=good`, 600 frames, with the report",
        lambda f: f"{f['explain_s']:.0f} s, {f['explain_peak_memory_mib'] / 1024:.1f} GiB",
        "120 s, 2 GiB",
    ),
)
"""Adversarial tests."""
PROOF = (
    Row(
        "prove",
        "fraction of all placements from which the default policy fails, exact, 5 seeds",
        lambda f: ", ".join(map(percent, f["proof_lost"])),
        "",
    ),
    Row(
        "prove",
        "greatest undecided fraction of these proofs",
        lambda f: percent(f["proof_undecided"]),
        "0.0001%",
    ),
    Row(
        "prove",
        "seconds of these proofs",
        lambda f: f"{_seconds(f['proof_three_s'])}, {_slower(f)}",
        "240",
    ),
    Row(
        "prove",
        "seconds of a proof with two cubes, policy good",
        lambda f: f"{f['proof_two_s']:.1f}, {_slower(f)}",
        "4",
    ),
    Row(
        "prove",
        "simulated episodes that end differently than proved",
        lambda f: f"{f['proof_contradicted']} of {f['proof_flights']:,}",
        "0",
    ),
    Row(
        "prove",
        "certificates that the independent checker accepts",
        lambda f: f"{f['proof_checked']} of {f['proof_checked_total']}",
        "all",
    ),
    Row(
        "places",
        "random images that differ from the closed form",
        lambda f: f"{f['places_wrong']} of {f['places_compared']:,}",
        "0",
    ),
    Row(
        "places",
        "seconds to compute an exact response map",
        lambda f: f"{f['places_s']:.1f}, {f['places_cells']:,} cells",
        "15",
    ),
    Row(
        "provable",
        "minutes until `experiment=provable` is proved, 3 seeds",
        lambda f: ", ".join(f"{seconds / 60:.1f}" for seconds in f["provable_s"]),
        "30",
    ),
    Row(
        "exact_coverage",
        "fraction of verdict intervals that contain the exact success rate",
        lambda f: percent(f["verdict_coverage_exact"]),
        "94.5%",
    ),
    Row(
        "many_cubes",
        "fraction decided within an hour, policy good: four cubes; five cubes",
        lambda f: f"{percent(f['proof_four'])}; {percent(f['proof_five'])}",
        "",
    ),
)
"""Verification."""
MAIN = (
    Row(
        "solve",
        "seconds from the start of `drone-rl train` to a running mean of 2.97 of 3 cubes, 5 seeds",
        _times,
        "60",
    ),
    Row("solve", "seeds of 5 that reach this mean", lambda f: str(f["seeds_solved"]), "5"),
    Row(
        "solve",
        "success rate in 1,000 held-out episodes, lower end of the exact 95% CI, worst of 5 seeds",
        lambda f: percent(min(f["success_lower95"])),
        "95%",
    ),
    Row(
        "seeds",
        "20 other seeds: number that reach this mean; worst lower end of the 95% CI",
        lambda f: f"{f['seeds_solved_of_20']}; {percent(min(f['seeds_lower95']))}",
        "20",
    ),
    Row(
        "imitation",
        "policies cloned from 30 flights of the oracle, success rate in 1,000 held-out episodes, "
        "3 seeds",
        lambda f: ", ".join(map(percent, f["imitation_success"])),
        "80%",
    ),
    Row(
        "imitation",
        "the same after REINFORCE, and the frames that it collected",
        _imitated,
        "95%",
    ),
    Row(
        "solve",
        "training frames/s, collection and learning together",
        lambda f: f"{f['learning_fps']:,.0f}",
        "16,000",
    ),
    Row(
        "large",
        "the same with images of 100x256 (`experiment=large`)",
        lambda f: f"{f['learning_fps_large']:,.0f}",
        "2,440",
    ),
    Row(
        "render",
        "rendering at 25x64, frames/s; ratio to MuJoCo Warp's renderer at 25x64; 64x64; 100x256",
        _rendering,
        "-",
    ),
    Row(
        "render",
        "rendering at 64x64, frames/s",
        lambda f: f"{f['raw_render_fps_64']:,.0f}",
        "70,000",
    ),
    Row(
        "render",
        "the same with `appearance=blocks`: 30 geoms, textures, shadows, fog",
        lambda f: f"{f['raw_render_blocks_fps_64']:,.0f}",
        "25,000",
    ),
    Row(
        "render",
        "time of RGB, gray, depth, distance, segmentation and normals in one pass, relative to RGB",
        lambda f: f"{f['render_all_over_rgb']:.2f}",
        "at most 1.6",
    ),
    Row(
        "collector",
        "frames/s of the collector with a policy, relative to rendering only by MuJoCo Warp, 25x64",
        _rates,
        "0.7",
    ),
    Row(
        "collector",
        "frames/s of the collector with a policy, best number of environments; 16 environments",
        lambda f: (
            f"{f['collector_fps']:,.0f} ({f['collector_worlds']} environments); "
            f"{f['collector_fps_16']:,.0f}"
        ),
        "40,000; 15,000",
    ),
    Row(
        "dm_control",
        "frames/s of the batched environment relative to dm_control with EGL, default quality",
        lambda f: f"{f['batched_over_dm_control']:.0f} times ({f['dm_control_fps']:.0f} frames/s)",
        "100 times",
    ),
    Row(
        "dm_control",
        "the same with dm_control's quality tuned manually",
        lambda f: (
            f"{f['batched_over_dm_control_tuned']:.1f} times "
            f"({f['dm_control_tuned_fps']:.0f} frames/s)"
        ),
        "1.5 times",
    ),
    Row(
        "memory",
        "peak memory of the default training",
        lambda f: f"{f['peak_memory_mib']:.0f} MiB",
        "1,024 MiB",
    ),
    Row(
        "memory",
        "memory growth over 1,000,000 frames after the first 100,000",
        lambda f: f"{round(f['memory_growth_mib_per_million_frames'], 1) + 0.0:.1f} MiB",
        "5 MiB",
    ),
    Row(
        "startup",
        "time from the start of `drone-rl train` to its first update, kernels cached",
        lambda f: (
            f"{f['start_to_first_update_s']:.1f} s with {f['import_torch_s']:.1f} s for `import "
            f"torch`; {f['start_to_first_update_scaled_s']:.1f} s scaled to 1 s for it"
        ),
        "4 s",
    ),
    Row(
        "startup",
        "time of `drone-rl verdict policy=good`, 400 episodes; scaled likewise",
        lambda f: f"{f['verdict_s']:.1f} s; {f['verdict_scaled_s']:.1f} s",
        "6 s",
    ),
    Row(
        "startup",
        "additional time if kernels must be compiled; scaled likewise",
        lambda f: f"{f['first_compile_s']:.0f} s; {f['first_compile_scaled_s']:.0f} s",
        "15 s",
    ),
    Row("startup", "time of `import drone_rl`", lambda f: seconds(f["import_s"]), "0.3 s"),
    Row(
        "explain",
        "time of t-SNE with 600 frames; 10,000 frames",
        lambda f: f"{seconds(f['tsne_600_s'])}; {seconds(f['tsne_10000_s'])}",
        "5 s; 60 s",
    ),
    Row(
        "explain",
        "time of a response map, 41 x 31 positions",
        lambda f: seconds(f["response_map_s"]),
        "3 s",
    ),
    Row(
        "explain",
        "action probability of class models, policy good (forward, left, right)",
        _class_models,
        "0.99",
    ),
    Row(
        "original",
        "`experiment=original`, best of six settings: seeds of 5 that reach 2.99 of 3",
        lambda f: f"{f['original_solved']} ({f['original_best'].replace('_', ' ')})",
        "4",
    ),
    Row(
        "chapter",
        "its time for 30,000 episodes, minutes; frames/s relative to stepping in Python",
        lambda f: f"{f['original_minutes']:.1f}; {f['original_speedup']:.1f} times",
        "15; 3 times",
    ),
    Row(
        "chapter",
        "elements of the chapter that a command or test shows; cases of signs and cameras",
        lambda f: f"{f['chapter_shown']} of {f['chapter_elements']}; {f['convention_cases']}",
        "all; 30",
    ),
    Row(
        "chapter",
        "success rate on a task that needs memory (`examples/recall.py`), an LSTM; no memory",
        lambda f: f"{100 * f['lstm_success']:.1f}%; {100 * f['memoryless_success']:.1f}%",
        "90%; at most 60%",
    ),
    Row("explain", "size of report.html", lambda f: f"{f['report_mib']:.1f} MiB", "10 MB"),
    Row(
        "sweeps",
        "training runs per hour in a sweep, two parallel runs relative to one",
        lambda f: f"{f['sweep_speedup']:.2f} times",
        "1.6 times",
    ),
    Row(
        "sweeps",
        "overhead of launcher and logging relative to training runs without them",
        lambda f: f"{100 * f['launcher_overhead']:.1f}%",
        "10%",
    ),
    Row(
        "kills",
        "runs with bit-identical results in a sweep that was killed three times",
        lambda f: f"{f['sweep_runs_same_after_kills']} of {f['sweep_runs']}",
        "all",
    ),
    Row(
        "ray",
        "frames/s with `collector=ray` relative to the default collector",
        lambda f: f"{f['ray_over_plain']:.2f}",
        "0.8",
    ),
)
"""Training and sweeps."""
