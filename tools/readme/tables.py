"""README's tables of figures: what each row says, of which keys of docs/results.json."""

import statistics
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

Figures = Mapping[str, Any]
UNKNOWN = "not measured yet"


class Row(NamedTuple):
    """A line of a table."""

    what: str
    measured: Callable[[Figures], str]
    """Takes what it needs by key; a key that is missing leaves the cell unmeasured."""
    asked: str


def make_table(rows: tuple[Row, ...], figures: Figures) -> str:
    """A table in Markdown."""
    lines = ["| what | measured | asked for |", "| --- | --- | --- |"]
    return "\n".join([*lines, *(f"| {r.what} | {_cell(r, figures)} | {r.asked} |" for r in rows)])


def _cell(row: Row, figures: Figures) -> str:
    try:
        return row.measured(figures)
    except KeyError:
        return UNKNOWN


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


TRUTH = (
    Row(
        "smallest coverage of a 95% interval that is shown, by enumeration and simulation "
        "(`bench coverage`)",
        lambda f: f"{f['interval_coverage_min']:.3f}",
        "0.945",
    ),
    Row(
        "certain and wrong, the worst of 36 simulated policies at and around the thresholds (the "
        "same)",
        lambda f: f"{f['false_certain_rate']:.3f}",
        "at most 0.05",
    ),
    Row(
        "maps that say nothing of the policy and are trusted (`bench maps`)",
        lambda f: f"{f['placebo_maps_trusted']} of {f['placebo_maps_total']}",
        "0",
    ),
    Row(
        "planted networks whose true map is trusted (the same)",
        lambda f: (
            f"{f['planted_maps_found'] * f['planted_maps_total']:.0f} of {f['planted_maps_total']}"
        ),
        "0.9",
    ),
    Row(
        "planted changes of evidence that change or take the sentence (`bench sentences`)",
        lambda f: f"{f['sentences_flipped']} of {f['sentences_total']}",
        "all",
    ),
    Row(
        "verdicts called certain that agree with 5,000 other episodes (`bench verdicts`)",
        _verdicts,
        "all",
    ),
    Row(
        "hostile files refused in one line, with nothing run, read or written (`bench hostile`)",
        lambda f: f"{f['hostile_refused']} of {f['hostile_total']}",
        "all",
    ),
    Row(
        "mutants killed, of those sampled that change anything (`bench mutants`)",
        lambda f: (
            f"{f['mutation_score_at_first_sight']:.2f} at first sight of the sample of "
            f"{f['mutants_sampled']}; {f['mutation_score']:.2f} once its survivors had tests"
        ),
        "0.9",
    ),
    Row(
        "`drone-rl explain policy=good`, 600 frames, report included (`bench explain`)",
        lambda f: f"{f['explain_s']:.0f} s, {f['explain_peak_memory_mib'] / 1024:.1f} GiB",
        "120 s, 2 GiB",
    ),
)
"""Whether what the program says holds against an adversary."""


def _shares(values: Sequence[float]) -> str:
    return ", ".join(f"{value:.2g}" if value else "0" for value in values)


def _seconds(values: Sequence[float]) -> str:
    return ", ".join(f"{value:.0f}" for value in values)


def _slower(f: Figures) -> str:
    """Than the one for which the figures were asked, by how the bench scaled its seconds."""
    return f"on a machine {f['proof_two_s'] / f['proof_two_scaled_s']:.1f} times slower"


PROOF = (
    Row(
        "share of all placements that the default's 5 seeds fail at, exactly (`bench prove`)",
        lambda f: _shares(f["proof_lost"]),
        "",
    ),
    Row(
        "the same, undecided at most",
        lambda f: f"{f['proof_undecided']:.1e}",
        "1e-6",
    ),
    Row(
        "seconds of these proofs (the same)",
        lambda f: f"{_seconds(f['proof_three_s'])}, {_slower(f)}",
        "240",
    ),
    Row(
        "seconds of a proof with two cubes, policy good (the same)",
        lambda f: f"{f['proof_two_s']:.1f}, {_slower(f)}",
        "4",
    ),
    Row(
        "flights of the simulator that end otherwise than proved (the same)",
        lambda f: f"{f['proof_contradicted']} of {f['proof_flights']:,}",
        "0",
    ),
    Row(
        "certificates that the second checker accepts (the same)",
        lambda f: f"{f['proof_checked']} of {f['proof_checked_total']}",
        "all",
    ),
    Row(
        "tampered certificates that it refuses (`bench tampering`)",
        lambda f: f"{f['tampered_refused']} of {f['tampered_total']}",
        "all",
    ),
    Row(
        "random pictures that are not the closed form's (`bench places`)",
        lambda f: f"{f['places_wrong']} of {f['places_compared']:,}",
        "0",
    ),
    Row(
        "seconds of an exact map (the same)",
        lambda f: f"{f['places_s']:.1f}, {f['places_cells']:,} cells",
        "15",
    ),
    Row(
        "minutes until `experiment=provable` is proved, three seeds (`bench provable`)",
        lambda f: ", ".join(f"{seconds / 60:.1f}" for seconds in f["provable_s"]),
        "30",
    ),
    Row(
        "intervals of verdicts that hold the exact share (`bench exact_coverage`)",
        lambda f: f"{f['verdict_coverage_exact']:.3f}",
        "0.945",
    ),
    Row(
        "four and five cubes, policy good: share decided within an hour (`bench many_cubes`)",
        lambda f: f"{f['proof_four']:.2g}; {f['proof_five']:.2g}",
        "",
    ),
)
MAIN = (
    Row(
        "seconds from the start of `drone-rl train` to a running mean of 2.97 of 3 cubes, 5 seeds "
        "(`bench solve`)",
        _times,
        "60",
    ),
    Row("seeds of 5 that reach it (the same)", lambda f: str(f["seeds_solved"]), "5"),
    Row(
        "share of 1,000 episodes in worlds to report on with all cubes, lower end of the exact 95% "
        "interval, the least of 5 seeds (the same)",
        lambda f: f"{min(f['success_lower95']):.3f}",
        "0.95",
    ),
    Row(
        "drawing at 25x64, frames/s, and over MuJoCo Warp's renderer at 25x64; 64x64; 100x256 "
        "(`bench render`)",
        _drawing,
        "-",
    ),
    Row(
        "collector, policy in the loop, over what MuJoCo Warp draws alone, 25x64, frames/s "
        "(`bench collector`)",
        _rates,
        "0.7",
    ),
    Row(
        "batched environment over dm_control's pixel path, EGL, default quality "
        "(`bench dm_control`)",
        lambda f: f"{f['batched_over_dm_control']:.0f} times ({f['dm_control_fps']:.0f} frames/s)",
        "100 times",
    ),
    Row(
        "the same, dm_control's quality tuned by hand",
        lambda f: (
            f"{f['batched_over_dm_control_tuned']:.1f} times "
            f"({f['dm_control_tuned_fps']:.0f} frames/s)"
        ),
        "1.5 times",
    ),
    Row(
        "peak memory of the default training (`bench memory`)",
        lambda f: f"{f['peak_memory_mib']:.0f} MiB",
        "1,024 MiB",
    ),
    Row(
        "growth of memory over 1,000,000 frames after the first 100,000 (the same)",
        lambda f: f"{f['memory_growth_mib_per_million_frames']:.0f} MiB",
        "5 MiB",
    ),
    Row(
        "start of `drone-rl train` to its first update, kernels cached (`bench room`)",
        lambda f: (
            f"{f['start_to_first_update_s']:.1f} s where `import torch` takes "
            f"{f['import_torch_s']:.1f} s: {f['start_to_first_update_scaled_s']:.1f} s where it "
            "takes 1 s"
        ),
        "4 s",
    ),
    Row(
        "`drone-rl verdict policy=good`, 400 episodes (the same)",
        lambda f: f"{f['verdict_s']:.1f} s; {f['verdict_scaled_s']:.1f} s",
        "6 s",
    ),
    Row("`import drone_rl` (the same)", lambda f: f"{f['import_s']:.2f} s", "0.3 s"),
    Row(
        "t-SNE of 600 frames; of 10,000 (`bench explain`)",
        lambda f: f"{f['tsne_600_s']:.1f} s; {f['tsne_10000_s']:.0f} s",
        "5 s; 60 s",
    ),
    Row("response map, 41 x 31 places (the same)", lambda f: f"{f['response_map_s']:.1f} s", "3 s"),
    Row(
        "probability that the good policy's class models reach (forward, left, right; the same)",
        _class_models,
        "0.99",
    ),
    Row("size of report.html (the same)", lambda f: f"{f['report_mib']:.1f} MiB", "10 MB"),
    Row(
        "trainings an hour of a sweep, two at once over one at a time (`bench sweeps`)",
        lambda f: f"{f['sweep_speedup']:.2f} times",
        "1.6 times",
    ),
    Row(
        "what launcher and logging add to the time of bare trainings (the same)",
        lambda f: f"{100 * f['launcher_overhead']:.1f}%",
        "10%",
    ),
    Row(
        "runs that end the same, to the last bit, in a sweep killed three times (`bench kills`)",
        lambda f: f"{f['sweep_runs_same_after_kills']} of {f['sweep_runs']}",
        "all",
    ),
    Row(
        "frames/s of collecting with `collector=ray` over the plain collector (`bench ray`)",
        lambda f: f"{f['ray_over_plain']:.2f}",
        "0.8",
    ),
)
"""The main job and sweeps."""
