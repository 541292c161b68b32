"""The registry of all benchmarks, by name."""

from collections.abc import Iterable, Sequence
from typing import Any

from benchmarks.accessibility import bench_accessibility
from benchmarks.airsim import bench_airsim
from benchmarks.airsim_chapter import bench_airsim_chapter
from benchmarks.airsim_scripts import bench_scripts
from benchmarks.benchmark import Benchmark, Setup
from benchmarks.chapter import bench_chapter
from benchmarks.coverage import bench_coverage
from benchmarks.domain_axes import bench_domain_axes
from benchmarks.exact_coverage import bench_exact_coverage
from benchmarks.explain import bench_explain
from benchmarks.flight_parity import bench_flight_parity
from benchmarks.flight_paths import bench_flight_paths
from benchmarks.flight_speed import bench_flight_speed
from benchmarks.fly_page import bench_fly_page
from benchmarks.fragile_honest import bench_fragile_honest
from benchmarks.gamed import bench_gamed
from benchmarks.gymnasium import bench_gymnasium
from benchmarks.imitation import bench_imitation
from benchmarks.injections import bench_injections
from benchmarks.ledger import digest_code
from benchmarks.maps import bench_maps
from benchmarks.memory import bench_memory
from benchmarks.onnx_export import bench_onnx
from benchmarks.original import bench_original
from benchmarks.peers.comparison import bench_peers
from benchmarks.places import bench_places
from benchmarks.proving import bench_many_cubes, bench_provable, bench_prove, bench_tampering
from benchmarks.render_truth import bench_render_truth
from benchmarks.revisions import bench_revisions
from benchmarks.robust import bench_robust
from benchmarks.scaling import bench_scaling
from benchmarks.sentences import bench_sentences
from benchmarks.shifts import bench_shifts
from benchmarks.speed import bench_collector, bench_dm_control, bench_render
from benchmarks.startup import bench_startup
from benchmarks.sweeps import bench_kills, bench_ray, bench_sweeps
from benchmarks.training import (
    bench_flight_training,
    bench_large,
    bench_pillars,
    bench_seeds,
    bench_solve,
)
from benchmarks.verdicts import bench_verdicts
from drone_rl.utils.errors import InputError
from tools.docs.run import measure as measure_pages

_RENDERING = ("sim", "envs")
_COLLECTING = (*_RENDERING, "policies", "collectors")
_TRAINING = (*_COLLECTING, "objectives", "training")
_JUDGING = (*_RENDERING, "policies", "trust")
_PROVING = (*_RENDERING, "policies", "verification/prover", "verification/checker")
_EXPLAINING = (*_JUDGING, "explanations")
_ORIGINAL = (*_TRAINING, "conf", "benchmarks/original")
_CLAIMS = ("trust", "verification", "explanations", "sweeps")


def _flight_training(setup: Setup, experiment: str, seeds: Sequence[int]) -> dict[str, Any]:
    runs = setup.runs / experiment
    return bench_flight_training(experiment, runs, seeds, setup.episodes, setup.device, setup.quick)


def _original(setup: Setup) -> dict[str, Any]:
    runs = setup.folder / "original" / digest_code(_ORIGINAL[:-1])  # plotting may change
    return bench_original(runs, setup.folder / "original.png", setup.quick)


BENCHMARKS: dict[str, Benchmark] = {
    "render": Benchmark(
        lambda s: bench_render(s.batch_size, s.device, s.quick),
        "main",
        (*_RENDERING, "benchmarks/speed"),
    ),
    "collector": Benchmark(
        lambda s: bench_collector(s.batch_size, s.device, s.quick),
        "main",
        (*_COLLECTING, "benchmarks/speed"),
    ),
    "dm_control": Benchmark(
        lambda s: bench_dm_control(s.batch_size, s.device, s.quick),
        "main",
        (*_RENDERING, "benchmarks/speed", "benchmarks/dm_control"),
    ),
    "scaling": Benchmark(
        lambda s: bench_scaling(s.folder, s.device, s.quick),
        "main",
        (*_RENDERING, "benchmarks/scaling"),
    ),
    "memory": Benchmark(
        lambda s: bench_memory(s.runs, s.memory_frames, s.device, s.quick),
        "main",
        (*_TRAINING, "benchmarks/memory"),
    ),
    "solve": Benchmark(
        lambda s: bench_solve(s.runs, s.seeds, s.episodes, s.device, s.quick),
        "main",
        (*_TRAINING, "trust", "conf", "benchmarks/training"),
    ),
    "seeds": Benchmark(
        lambda s: bench_seeds(s.runs / "seeds", s.device, s.quick),
        "main",
        (*_TRAINING, "trust", "conf", "benchmarks/training"),
    ),
    "large": Benchmark(
        lambda s: bench_large(s.runs, s.device, s.quick),
        "main",
        (*_TRAINING, "conf", "benchmarks/training"),
    ),
    "coverage": Benchmark(
        lambda s: bench_coverage(s.quick),
        "adversarial",
        ("utils/intervals", "trust", "benchmarks/coverage", "benchmarks/simulated_policies"),
    ),
    "sentences": Benchmark(
        lambda s: bench_sentences(),
        "adversarial",
        (
            *_CLAIMS,
            "benchmarks/sentences",
            "benchmarks/evidence",
            "benchmarks/evidence_changes",
        ),
    ),
    "injections": Benchmark(
        lambda s: bench_injections(s.runs / "injections"),
        "adversarial",
        (
            *_CLAIMS,
            "utils/display",
            "benchmarks/injections",
            "benchmarks/injected_pages",
        ),
    ),
    "accessibility": Benchmark(
        lambda s: bench_accessibility(s.runs / "accessibility", s.quick),
        "adversarial",
        ("explanations", "utils/display", "benchmarks/accessibility"),
    ),
    "gamed": Benchmark(
        lambda s: bench_gamed(s.runs / "gamed"),
        "adversarial",
        (
            *_JUDGING,
            "benchmarks/gamed",
            "benchmarks/gamed_memory",
            "benchmarks/gamed_rounding",
            "benchmarks/gamed_certificates",
        ),
    ),
    "maps": Benchmark(
        lambda s: bench_maps(s.runs, s.quick),
        "adversarial",
        (
            *_EXPLAINING,
            "benchmarks/maps",
            "benchmarks/adversarial_maps",
            "benchmarks/known_map_policies",
        ),
    ),
    "explain": Benchmark(
        lambda s: bench_explain(s.runs, s.quick),
        "adversarial",
        (*_EXPLAINING, "explanations/report", "conf", "benchmarks/explain"),
    ),
    "verdicts": Benchmark(
        lambda s: bench_verdicts(s.runs, s.device, s.quick),
        "adversarial",
        (*_JUDGING, "benchmarks/verdicts", "benchmarks/scripted_policies"),
    ),
    "fragile_honest": Benchmark(
        lambda s: bench_fragile_honest(s.runs / "fragile_honest", s.seeds, s.quick),
        "adversarial",
        (*_TRAINING, *_JUDGING, "conf", "benchmarks/fragile_honest"),
    ),
    "shifts": Benchmark(
        lambda s: bench_shifts(s.quick),
        "adversarial",
        (*_JUDGING, "benchmarks/shifts"),
    ),
    "domain_axes": Benchmark(
        lambda s: bench_domain_axes(s.runs / "domain_axes", s.quick),
        "adversarial",
        (*_JUDGING, "benchmarks/domain_axes"),
    ),
    "robust": Benchmark(
        lambda s: bench_robust(s.runs / "robust", s.seeds[:3], s.quick),
        "adversarial",
        (
            *_TRAINING,
            "trust",
            "conf",
            "benchmarks/robust",
            "benchmarks/robust_comparison",
        ),
    ),
    "render_truth": Benchmark(
        lambda s: bench_render_truth(s.quick),
        "adversarial",
        ("sim/rendering", "benchmarks/render_truth", "benchmarks/random_scenes"),
    ),
    "docs": Benchmark(lambda s: measure_pages(), "adversarial", (".", "conf")),
    "sweeps": Benchmark(
        lambda s: bench_sweeps(s.runs, s.device, s.quick),
        "parallel",
        (*_TRAINING, "sweeps", "conf", "benchmarks/sweeps"),
    ),
    "kills": Benchmark(
        lambda s: bench_kills(s.runs, s.device, s.quick),
        "parallel",
        (*_TRAINING, "sweeps", "conf", "benchmarks/sweeps"),
    ),
    "ray": Benchmark(
        lambda s: bench_ray(s.runs, s.device, s.quick),
        "parallel",
        (*_COLLECTING, "conf", "benchmarks/sweeps"),
    ),
    "prove": Benchmark(
        lambda s: bench_prove(s.runs / "prove", s.seeds, s.quick),
        "verification",
        (*_PROVING, "benchmarks/proving"),
    ),
    "tampering": Benchmark(
        lambda s: bench_tampering(s.runs / "tampering", s.quick),
        "verification",
        (
            *_PROVING,
            "benchmarks/tampering",
            "benchmarks/tampered_inconsistent",
            "benchmarks/tampered_consistent",
        ),
    ),
    "places": Benchmark(
        lambda s: bench_places(s.quick), "verification", (*_PROVING, "benchmarks/places")
    ),
    "exact_coverage": Benchmark(
        lambda s: bench_exact_coverage(s.runs / "exact_coverage", s.quick),
        "verification",
        (*_TRAINING, *_PROVING, "trust", "benchmarks/exact_coverage"),
    ),
    "provable": Benchmark(
        lambda s: bench_provable(s.runs / "provable", s.seeds[:3], s.quick),
        "verification",
        (*_TRAINING, *_PROVING, "conf", "benchmarks/proving"),
    ),
    "many_cubes": Benchmark(
        lambda s: bench_many_cubes(s.runs / "many_cubes", 1.0, s.quick),
        "long",
        (*_PROVING, "benchmarks/proving"),
    ),
    "pillars": Benchmark(
        lambda s: bench_pillars(s.runs / "pillars", s.seeds[:3], s.episodes, s.device, s.quick),
        "libraries",
        (*_TRAINING, "trust", "conf", "benchmarks/training"),
    ),
    "revisions": Benchmark(
        lambda s: bench_revisions(s.runs / "revisions", s.quick),
        "system",
        (*_TRAINING, "trust", "explanations", "cli", "conf", "benchmarks/revisions"),
    ),
    "imitation": Benchmark(
        lambda s: bench_imitation(s.runs / "imitation", s.seeds[:3], s.episodes, s.device, s.quick),
        "long",
        (*_TRAINING, "trust", "conf", "benchmarks/imitation", "benchmarks/training"),
    ),
    "original": Benchmark(
        _original,
        "long",
        _ORIGINAL,
    ),
    "chapter": Benchmark(
        lambda s: bench_chapter(s.runs / "chapter", s.quick),
        "long",
        (*_TRAINING, "acceleration", "flight/commands", "conf", "benchmarks/chapter"),
    ),
    "fly_page": Benchmark(
        lambda s: bench_fly_page(s.runs / "fly_page", s.quick),
        "flight",
        (*_RENDERING, "flight", "policies", "benchmarks/fly_page"),
    ),
    "airsim": Benchmark(
        lambda s: {
            **bench_airsim(s.runs / "airsim", s.quick),
            **bench_scripts(s.runs / "airsim_scripts"),
            **bench_airsim_chapter(s.runs / "airsim_chapter", s.quick),
        },
        "flight",
        (
            *_RENDERING,
            "flight",
            "benchmarks/airsim",
            "benchmarks/airsim_chapter",
            "benchmarks/airsim_programs",
        ),
    ),
    "startup": Benchmark(
        lambda s: bench_startup(s.runs / "startup", s.device, s.quick),
        "system",
        (*_TRAINING, "trust", "config", "cli", "conf", "benchmarks/startup"),
    ),
    "onnx": Benchmark(
        lambda s: bench_onnx(s.runs / "onnx", s.quick),
        "libraries",
        (*_RENDERING, "policies", "trust", "benchmarks/onnx_export"),
    ),
    "peers": Benchmark(
        lambda s: bench_peers(s.runs / "peers", s.seeds[:3], s.episodes, s.quick),
        "libraries",
        (*_TRAINING, "config", "cli", "conf", "benchmarks/peers"),
    ),
    "gymnasium": Benchmark(
        lambda s: bench_gymnasium(s.batch_size, s.device, s.quick),
        "libraries",
        (*_RENDERING, "benchmarks/gymnasium"),
    ),
    "flight_speed": Benchmark(
        lambda s: bench_flight_speed(s.quick), "flight", (*_COLLECTING, "benchmarks/flight_speed")
    ),
    "flight_parity": Benchmark(
        lambda s: bench_flight_parity(s.quick), "flight", ("sim", "benchmarks/flight_parity")
    ),
    "flight_paths": Benchmark(
        lambda s: bench_flight_paths(s.quick),
        "flight",
        ("sim", "flight/commands", "benchmarks/flight_paths"),
    ),
    "flight_moves": Benchmark(
        lambda s: _flight_training(s, "flight", s.seeds),
        "flight",
        (*_TRAINING, "trust", "conf", "benchmarks/training"),
    ),
    "flight_velocity": Benchmark(
        lambda s: _flight_training(s, "flight_velocity", s.seeds[:3]),
        "flight",
        (*_TRAINING, "trust", "conf", "benchmarks/training"),
    ),
    "flight_pillars": Benchmark(
        lambda s: _flight_training(s, "flight_pillars", s.seeds[:3]),
        "flight",
        (*_TRAINING, "trust", "conf", "benchmarks/training"),
    ),
}
GROUPS = tuple(dict.fromkeys(benchmark.group for benchmark in BENCHMARKS.values()))
"""Names of groups of benchmarks: main (speed and training), adversarial (correctness of claims),
parallel (sweeps), verification, long (proofs of hours), libraries (third-party software), system
(revisions and start-up time), flight (vehicle dynamics)."""


def find_benchmarks(names: Iterable[str]) -> list[str]:
    """Return the benchmarks of some names and groups, each once, in the order of the arguments.

    Args:
        names: Names of benchmarks and of groups.

    Raises:
        InputError: A name is neither a benchmark's nor a group's.
    """
    found: dict[str, None] = {}
    for name in names:
        matches = [n for n, b in BENCHMARKS.items() if name in (n, b.group)]
        if not matches:
            known = ", ".join((*GROUPS, *BENCHMARKS))
            raise InputError(f"benchmark {name!r} is unknown; use some of: {known}")
        found |= dict.fromkeys(matches)
    return list(found)
