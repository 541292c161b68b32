"""What the tables of figures say, row by row, of which keys of docs/results.json."""

import statistics
from collections.abc import Sequence

from tools.readme.tables import Figures, Row


def _times(f: Figures) -> str:
    times = f["time_to_solve_s"]
    return f"{min(times):.0f} to {max(times):.0f}, median {statistics.median(times):.0f}"


def _rates(f: Figures) -> str:
    collected, drawn = f["collector_fps"], f["raw_render_beside_collector_fps"]
    return f"{f['collector_over_raw']:.2f} ({collected:,.0f} over {drawn:,.0f})"


def _drawing(f: Figures) -> str:
    ratios = "; ".join(f"{ratio:.1f}" for ratio in f["render_over_warp"].values())
    return f"{f['raw_render_fps']:,.0f}; {ratios} times"


def _class_models(f: Figures) -> str:
    return ", ".join(f"{p:.3f}" for p in f["class_model_probability"])


def _verdicts(f: Figures) -> str:
    right, certain, total = (f[f"verdicts_{name}"] for name in ("right", "certain", "total"))
    return f"{right} of {certain} certain, of {total}"


def _planted(f: Figures) -> str:
    share, total = f["planted_maps_found"], f["planted_maps_total"]
    return f"{share * total:.0f} of {total}"


def _shares(values: Sequence[float]) -> str:
    return ", ".join(f"{value:.2g}" if value else "0" for value in values)


def _seconds(values: Sequence[float]) -> str:
    return ", ".join(f"{value:.0f}" for value in values)


def _slower(f: Figures) -> str:
    """Than the one for which the figures were asked, by how the bench scaled its seconds."""
    return f"on a machine {f['proof_two_s'] / f['proof_two_scaled_s']:.1f} times slower"


TRUTH = (
    Row(
        "coverage",
        "smallest coverage of a 95% interval that is shown, by enumeration and simulation",
        lambda f: f"{f['interval_coverage_min']:.3f}",
        "0.945",
    ),
    Row(
        "coverage",
        "certain and wrong, the worst of 42 simulated policies at and around the thresholds",
        lambda f: f"{f['false_certain_rate']:.3f}",
        "at most 0.05",
    ),
    Row(
        "maps",
        "maps that say nothing of the policy and are trusted",
        lambda f: f"{f['placebo_maps_trusted']} of {f['placebo_maps_total']}",
        "0",
    ),
    Row("maps", "planted networks whose true map is trusted", _planted, "0.9"),
    Row(
        "sentences",
        "planted changes of evidence that change or take the sentence",
        lambda f: f"{f['sentences_flipped']} of {f['sentences_total']}",
        "all",
    ),
    Row(
        "verdicts",
        "verdicts called certain that agree with 5,000 other episodes",
        _verdicts,
        "all",
    ),
    Row(
        "hostile",
        "hostile files refused in one line, with nothing run, read or written",
        lambda f: f"{f['hostile_refused']} of {f['hostile_total']}",
        "all",
    ),
    Row(
        "hostile",
        "the greatest memory, and processor time, of any of them after imports",
        lambda f: f"{f['hostile_peak_mib']:,.0f} MiB; {f['hostile_max_s']:.1f} s",
        "1,024 MiB; 2 s",
    ),
    Row(
        "gamed",
        "adversarial policies called good and certain, or proved",
        lambda f: f"{f['gamed_verdicts']} of {f['gamed_total']}",
        "0",
    ),
    Row(
        "fragile_honest",
        'honest policies, shipped or trained by default, that rounding makes "not certain"',
        lambda f: f"{f['fragile_honest']} of {f['fragile_honest_total']}",
        "0",
    ),
    Row(
        "injections",
        "injection payloads that run in Chromium, of one on a page each",
        lambda f: f"{f['injections_run']} of {f['injections_total']:,}",
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
        "pictures against OpenGL's, random scenes: pixels on no edge that show another geom; geoms "
        "of more than 30 pixels that overlap by 0.98, the least; depth, mm; colour, levels of 255",
        lambda f: (
            f"{f['render_truth_inner_wrong']}; {f['render_truth_overlapping']} of "
            f"{f['render_truth_geoms']}, {f['render_truth_least_overlap']:.3f}; "
            f"{f['render_truth_depth_mm']:.2f}; {f['render_truth_rgb']}, in "
            f"{f['render_truth_scenes']} scenes"
        ),
        "0; all; 1; 2",
    ),
    Row(
        "shifts",
        "seconds of a policy's flights under ten kinds of other conditions, five strengths each, "
        "200 episodes; mean area under success over strength, policy good",
        lambda f: (
            f"{f['shift_suite_s']:.0f} with {f['shift_suite_axes']} axes; {f['shift_area']:.2f}"
        ),
        "480",
    ),
    Row(
        "robust",
        "`experiment=robust` over the default, points of successful flights under the kinds of "
        "shift that training does not touch, three seeds; under all kinds; cost where nothing is "
        "different",
        lambda f: (
            f"{f['robust_gain_points']:+.1f} of {f['robust_room_points']:.1f} that there are to "
            f"gain; {f['robust_gain_all_kinds_points']:+.1f}; "
            f"{round(f['robust_cost_points'], 1) + 0.0:.1f}"
        ),
        "+15; -; at most 1",
    ),
    Row(
        "mutants",
        "mutants killed, of those sampled that change anything (`make mutants` before it)",
        lambda f: (
            f"{f['mutation_score_at_first_sight']:.2f} at first sight of the sample of "
            f"{f['mutants_sampled']}; {f['mutation_score']:.2f} once its survivors had tests"
        ),
        "0.9",
    ),
    Row(
        "explain",
        "`drone-rl explain policy=good`, 600 frames, report included",
        lambda f: f"{f['explain_s']:.0f} s, {f['explain_peak_memory_mib'] / 1024:.1f} GiB",
        "120 s, 2 GiB",
    ),
)
"""Whether what the program says holds against an adversary."""
PROOF = (
    Row(
        "prove",
        "share of all placements that the default's 5 seeds fail at, exactly",
        lambda f: _shares(f["proof_lost"]),
        "",
    ),
    Row("prove", "the same, undecided at most", lambda f: f"{f['proof_undecided']:.1e}", "1e-6"),
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
        "flights of the simulator that end otherwise than proved",
        lambda f: f"{f['proof_contradicted']} of {f['proof_flights']:,}",
        "0",
    ),
    Row(
        "prove",
        "certificates that the second checker accepts",
        lambda f: f"{f['proof_checked']} of {f['proof_checked_total']}",
        "all",
    ),
    Row(
        "tampering",
        "tampered certificates that it refuses",
        lambda f: f"{f['tampered_refused']} of {f['tampered_total']}",
        "all",
    ),
    Row(
        "places",
        "random pictures that are not the closed form's",
        lambda f: f"{f['places_wrong']} of {f['places_compared']:,}",
        "0",
    ),
    Row(
        "places",
        "seconds of an exact map",
        lambda f: f"{f['places_s']:.1f}, {f['places_cells']:,} cells",
        "15",
    ),
    Row(
        "provable",
        "minutes until `experiment=provable` is proved, three seeds",
        lambda f: ", ".join(f"{seconds / 60:.1f}" for seconds in f["provable_s"]),
        "30",
    ),
    Row(
        "exact_coverage",
        "intervals of verdicts that hold the exact share",
        lambda f: f"{f['verdict_coverage_exact']:.3f}",
        "0.945",
    ),
    Row(
        "many_cubes",
        "four and five cubes, policy good: share decided within an hour",
        lambda f: f"{f['proof_four']:.2g}; {f['proof_five']:.2g}",
        "",
    ),
)
"""What is proved."""
MAIN = (
    Row(
        "solve",
        "seconds from the start of `drone-rl train` to a running mean of 2.97 of 3 cubes, 5 seeds",
        _times,
        "60",
    ),
    Row("solve", "seeds of 5 that reach it", lambda f: str(f["seeds_solved"]), "5"),
    Row(
        "solve",
        "share of 1,000 episodes in worlds to report on with all cubes, lower end of the exact 95% "
        "interval, the least of 5 seeds",
        lambda f: f"{min(f['success_lower95']):.3f}",
        "0.95",
    ),
    Row(
        "seeds",
        "seeds of 20 others that reach it, and the least of their lower ends",
        lambda f: f"{f['seeds_solved_of_20']}; {min(f['seeds_lower95']):.3f}",
        "20",
    ),
    Row(
        "solve",
        "collecting and learning together, frames/s",
        lambda f: f"{f['learning_fps']:,.0f}",
        "16,000",
    ),
    Row(
        "large",
        "the same with pictures of 100x256 (`experiment=large`)",
        lambda f: f"{f['learning_fps_large']:,.0f}",
        "2,440",
    ),
    Row(
        "render",
        "drawing at 25x64, frames/s, and over MuJoCo Warp's renderer at 25x64; 64x64; 100x256",
        _drawing,
        "-",
    ),
    Row(
        "render",
        "drawing at 64x64, frames/s",
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
        "time of RGB, gray, depth, distance, segmentation and normals in one pass over that of RGB",
        lambda f: f"{f['render_all_over_rgb']:.2f}",
        "at most 1.6",
    ),
    Row(
        "collector",
        "collector, policy in the loop, over what MuJoCo Warp draws alone, 25x64, frames/s",
        _rates,
        "0.7",
    ),
    Row(
        "collector",
        "collector, policy in the loop, frames/s, with as many worlds as are best; with 16",
        lambda f: (
            f"{f['collector_fps']:,.0f} ({f['collector_worlds']} worlds); "
            f"{f['collector_fps_16']:,.0f}"
        ),
        "40,000; 15,000",
    ),
    Row(
        "dm_control",
        "batched environment over dm_control's pixel path, EGL, default quality",
        lambda f: f"{f['batched_over_dm_control']:.0f} times ({f['dm_control_fps']:.0f} frames/s)",
        "100 times",
    ),
    Row(
        "dm_control",
        "the same, dm_control's quality tuned by hand",
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
        "growth of memory over 1,000,000 frames after the first 100,000",
        lambda f: f"{round(f['memory_growth_mib_per_million_frames'], 1) + 0.0:.1f} MiB",
        "5 MiB",
    ),
    Row(
        "startup",
        "start of `drone-rl train` to its first update, kernels cached",
        lambda f: (
            f"{f['start_to_first_update_s']:.1f} s where `import torch` takes "
            f"{f['import_torch_s']:.1f} s: {f['start_to_first_update_scaled_s']:.1f} s where it "
            "takes 1 s"
        ),
        "4 s",
    ),
    Row(
        "startup",
        "`drone-rl verdict policy=good`, 400 episodes",
        lambda f: f"{f['verdict_s']:.1f} s; {f['verdict_scaled_s']:.1f} s",
        "6 s",
    ),
    Row(
        "startup",
        "the same without a cache of kernels, which are compiled then: seconds more",
        lambda f: f"{f['first_compile_s']:.0f} s; {f['first_compile_scaled_s']:.0f} s",
        "15 s",
    ),
    Row("startup", "`import drone_rl`", lambda f: f"{f['import_s']:.2f} s", "0.3 s"),
    Row(
        "explain",
        "t-SNE of 600 frames; of 10,000",
        lambda f: f"{f['tsne_600_s']:.1f} s; {f['tsne_10000_s']:.0f} s",
        "5 s; 60 s",
    ),
    Row(
        "explain",
        "response map, 41 x 31 places",
        lambda f: f"{f['response_map_s']:.1f} s",
        "3 s",
    ),
    Row(
        "explain",
        "probability that the good policy's class models reach (forward, left, right)",
        _class_models,
        "0.99",
    ),
    Row("explain", "size of report.html", lambda f: f"{f['report_mib']:.1f} MiB", "10 MB"),
    Row(
        "sweeps",
        "trainings an hour of a sweep, two at once over one at a time",
        lambda f: f"{f['sweep_speedup']:.2f} times",
        "1.6 times",
    ),
    Row(
        "sweeps",
        "what launcher and logging add to the time of bare trainings",
        lambda f: f"{100 * f['launcher_overhead']:.1f}%",
        "10%",
    ),
    Row(
        "kills",
        "runs that end the same, to the last bit, in a sweep killed three times",
        lambda f: f"{f['sweep_runs_same_after_kills']} of {f['sweep_runs']}",
        "all",
    ),
    Row(
        "ray",
        "frames/s of collecting with `collector=ray` over the plain collector",
        lambda f: f"{f['ray_over_plain']:.2f}",
        "0.8",
    ),
)
"""The main job and sweeps."""
