"""All benchmarks, by name."""

from collections.abc import Iterable, Sequence
from typing import Any

from drone_rl.bench.benchmark import Benchmark
from drone_rl.bench.coverage import bench_coverage
from drone_rl.bench.domain_axes import bench_domain_axes
from drone_rl.bench.exact_coverage import bench_exact_coverage
from drone_rl.bench.explain import bench_explain
from drone_rl.bench.flight_parity import bench_flight_parity
from drone_rl.bench.flight_paths import bench_flight_paths
from drone_rl.bench.flight_speed import bench_flight_speed
from drone_rl.bench.flight_training import bench_flight_training
from drone_rl.bench.fragile_honest import bench_fragile_honest
from drone_rl.bench.gamed import bench_gamed
from drone_rl.bench.gymnasium import bench_gymnasium
from drone_rl.bench.hostile import bench_hostile
from drone_rl.bench.injections import bench_injections
from drone_rl.bench.maps import bench_maps
from drone_rl.bench.memory import bench_memory
from drone_rl.bench.mutants import bench_mutants
from drone_rl.bench.onnx_export import bench_onnx
from drone_rl.bench.peers.side_by_side import bench_peers
from drone_rl.bench.places import bench_places
from drone_rl.bench.provable import bench_provable
from drone_rl.bench.proving import bench_many_cubes, bench_prove, bench_tampering
from drone_rl.bench.render_truth import bench_render_truth
from drone_rl.bench.robust import bench_robust
from drone_rl.bench.scaling import bench_scaling
from drone_rl.bench.sentences import bench_sentences
from drone_rl.bench.shifts import bench_shifts
from drone_rl.bench.speed import bench_collector, bench_dm_control, bench_render
from drone_rl.bench.startup import bench_startup
from drone_rl.bench.sweeps import bench_kills, bench_ray, bench_sweeps
from drone_rl.bench.training import bench_large, bench_pillars, bench_seeds, bench_solve
from drone_rl.bench.verdicts import bench_verdicts
from drone_rl.utils.errors import InputError

_DRAWING = ("sim", "envs")
_COLLECTING = (*_DRAWING, "policies", "collectors")
_TRAINING = (*_COLLECTING, "objectives", "training")
_JUDGING = (*_DRAWING, "policies", "evaluation", "verdicts")
_PROVING = (*_DRAWING, "policies", "proofs", "checks")
_EXPLAINING = (*_JUDGING, "explanations")


def _trained_in_flight(asked: Any, experiment: str, seeds: Sequence[int]) -> dict[str, Any]:
    runs = asked.runs / experiment
    return bench_flight_training(experiment, runs, seeds, asked.episodes, asked.device, asked.quick)


BENCHMARKS: dict[str, Benchmark] = {
    "render": Benchmark(
        lambda s: bench_render(s.worlds, s.device, s.quick), "main", (*_DRAWING, "bench/speed")
    ),
    "collector": Benchmark(
        lambda s: bench_collector(s.worlds, s.device, s.quick),
        "main",
        (*_COLLECTING, "bench/speed"),
    ),
    "dm_control": Benchmark(
        lambda s: bench_dm_control(s.worlds, s.device, s.quick),
        "main",
        (*_DRAWING, "bench/speed", "bench/dm_control"),
    ),
    "scaling": Benchmark(
        lambda s: bench_scaling(s.folder, s.device, s.quick), "main", (*_DRAWING, "bench/scaling")
    ),
    "memory": Benchmark(
        lambda s: bench_memory(s.runs, s.memory_frames, s.device, s.quick),
        "main",
        (*_TRAINING, "bench/memory"),
    ),
    "solve": Benchmark(
        lambda s: bench_solve(s.runs, s.seeds, s.episodes, s.device, s.quick),
        "main",
        (*_TRAINING, "evaluation", "conf", "bench/training"),
    ),
    "seeds": Benchmark(
        lambda s: bench_seeds(s.runs / "seeds", s.device, s.quick),
        "main",
        (*_TRAINING, "evaluation", "conf", "bench/training"),
    ),
    "large": Benchmark(
        lambda s: bench_large(s.runs, s.device, s.quick),
        "main",
        (*_TRAINING, "conf", "bench/training"),
    ),
    "coverage": Benchmark(
        lambda s: bench_coverage(s.quick),
        "truth",
        ("utils/intervals", "verdicts", "bench/coverage", "bench/simulated"),
    ),
    "sentences": Benchmark(
        lambda s: bench_sentences(), "truth", ("words", "bench/sentences", "bench/evidence")
    ),
    "hostile": Benchmark(
        lambda s: bench_hostile(s.runs / "hostile"),
        "truth",
        ("utils", "zoo", "training", "sweeps", "report", "checks", "conditions", "hydra_app",
         *(f"bench/hostile{part}" for part in
           ("", "_files", "_folders", "_json", "_arrays", "_policies", "_claims", "_runs"))),
    ),
    "injections": Benchmark(
        lambda s: bench_injections(s.runs / "injections"),
        "truth",
        ("words", "report", "sweeps", "api/showing", "utils/pages", "bench/injections",
         "bench/injected_pages", "bench/injection_payloads"),
    ),
    "gamed": Benchmark(
        lambda s: bench_gamed(s.runs / "gamed"),
        "truth",
        (*_JUDGING, "api", "conditions", "bench/gamed", "bench/gamed_memory",
         "bench/gamed_rounding", "bench/gamed_certificates"),
    ),
    "maps": Benchmark(
        lambda s: bench_maps(s.runs, s.quick),
        "truth",
        (*_EXPLAINING, "bench/maps", "bench/liars"),
    ),
    "explain": Benchmark(
        lambda s: bench_explain(s.runs, s.quick),
        "truth",
        (*_EXPLAINING, "report", "conf", "bench/explain"),
    ),
    "verdicts": Benchmark(
        lambda s: bench_verdicts(s.runs, s.device, s.quick),
        "truth",
        (*_JUDGING, "bench/verdicts", "bench/scripted"),
    ),
    "fragile_honest": Benchmark(
        lambda s: bench_fragile_honest(s.runs / "fragile_honest", s.seeds, s.quick),
        "truth",
        (*_TRAINING, *_JUDGING, "conf", "bench/fragile_honest"),
    ),
    "shifts": Benchmark(
        lambda s: bench_shifts(s.quick),
        "truth",
        (*_JUDGING, "conditions", "api/shifting", "bench/shifts"),
    ),
    "domain_axes": Benchmark(
        lambda s: bench_domain_axes(s.runs / "domain_axes", s.quick),
        "truth",
        (*_JUDGING, "conditions", "api/shifting", "api/domains", "api/reflying",
         "bench/domain_axes"),
    ),
    "robust": Benchmark(
        lambda s: bench_robust(s.runs / "robust", s.seeds[:3], s.quick),
        "truth",
        (*_TRAINING, "evaluation", "conditions", "conf", "bench/robust"),
    ),
    "render_truth": Benchmark(
        lambda s: bench_render_truth(s.quick),
        "truth",
        ("sim/rendering", "bench/render_truth", "bench/random_scenes"),
    ),
    "mutants": Benchmark(lambda s: bench_mutants(), "truth", ("bench/mutants",)),
    "sweeps": Benchmark(
        lambda s: bench_sweeps(s.runs, s.device, s.quick),
        "many",
        (*_TRAINING, "sweeps", "conf", "bench/sweeps"),
    ),
    "kills": Benchmark(
        lambda s: bench_kills(s.runs, s.device, s.quick),
        "many",
        (*_TRAINING, "sweeps", "conf", "bench/sweeps"),
    ),
    "ray": Benchmark(
        lambda s: bench_ray(s.runs, s.device, s.quick),
        "many",
        (*_COLLECTING, "conf", "bench/sweeps"),
    ),
    "prove": Benchmark(
        lambda s: bench_prove(s.runs / "prove", s.seeds, s.quick),
        "proof",
        (*_PROVING, "bench/proving"),
    ),
    "tampering": Benchmark(
        lambda s: bench_tampering(s.runs / "tampering", s.quick),
        "proof",
        (*_PROVING, "bench/tampering", "bench/tampered_parts", "bench/tampered_wholes"),
    ),
    "places": Benchmark(
        lambda s: bench_places(s.quick), "proof", (*_PROVING, "bench/places")
    ),
    "exact_coverage": Benchmark(
        lambda s: bench_exact_coverage(s.runs / "exact_coverage", s.quick),
        "proof",
        (*_TRAINING, *_PROVING, "verdicts", "bench/exact_coverage"),
    ),
    "provable": Benchmark(
        lambda s: bench_provable(s.runs / "provable", s.seeds[:3], s.quick),
        "proof",
        (*_TRAINING, *_PROVING, "conf", "bench/provable"),
    ),
    "many_cubes": Benchmark(
        lambda s: bench_many_cubes(s.runs / "many_cubes", 1.0, s.quick),
        "hours",
        (*_PROVING, "bench/proving"),
    ),
    "pillars": Benchmark(
        lambda s: bench_pillars(s.runs / "pillars", s.seeds[:3], s.episodes, s.device, s.quick),
        "guests",
        (*_TRAINING, "evaluation", "conf", "bench/training"),
    ),
    "startup": Benchmark(
        lambda s: bench_startup(s.runs / "startup", s.device, s.quick),
        "room",
        (*_TRAINING, "verdicts", "api", "settings", "hydra_app", "cli", "conf", "bench/startup"),
    ),
    "onnx": Benchmark(
        lambda s: bench_onnx(s.runs / "onnx", s.quick),
        "guests",
        (*_DRAWING, "policies", "zoo", "evaluation", "api/exporting", "bench/onnx_export"),
    ),
    "peers": Benchmark(
        lambda s: bench_peers(s.runs / "peers", s.seeds[:3], s.episodes, s.quick),
        "guests",
        (*_TRAINING, "api", "settings", "hydra_app", "cli", "conf", "bench/peers"),
    ),
    "gymnasium": Benchmark(
        lambda s: bench_gymnasium(s.worlds, s.device, s.quick),
        "guests",
        (*_DRAWING, "bench/gymnasium"),
    ),
    "flight_speed": Benchmark(
        lambda s: bench_flight_speed(s.quick), "flight", (*_COLLECTING, "bench/flight_speed")
    ),
    "flight_parity": Benchmark(
        lambda s: bench_flight_parity(s.quick), "flight", ("sim", "bench/flight_parity")
    ),
    "flight_paths": Benchmark(
        lambda s: bench_flight_paths(s.quick), "flight", ("sim", "pilot", "bench/flight_paths")
    ),
    "flight_moves": Benchmark(
        lambda s: _trained_in_flight(s, "flight", s.seeds),
        "flight",
        (*_TRAINING, "evaluation", "conf", "bench/flight_training"),
    ),
    "flight_velocity": Benchmark(
        lambda s: _trained_in_flight(s, "flight_velocity", s.seeds[:3]),
        "flight",
        (*_TRAINING, "evaluation", "conf", "bench/flight_training"),
    ),
    "flight_pillars": Benchmark(
        lambda s: _trained_in_flight(s, "flight_pillars", s.seeds[:3]),
        "flight",
        (*_TRAINING, "evaluation", "conf", "bench/flight_training"),
    ),
}  # fmt: skip
GROUPS = tuple(dict.fromkeys(benchmark.group for benchmark in BENCHMARKS.values()))
"""Names of several at once: the main job, whether what is said is true, proofs, many trainings,
what works with programs of others, drones in flight."""


def find_benchmarks(words: Iterable[str]) -> list[str]:
    """The benchmarks that words name, each once, in the order of the words.

    Args:
        words: Names of benchmarks and of groups.

    Raises:
        InputError: A word names neither.
    """
    names: dict[str, None] = {}
    for word in words:
        named = [n for n, b in BENCHMARKS.items() if word in (n, b.group)]
        if not named:
            known = ", ".join((*GROUPS, *BENCHMARKS))
            raise InputError(f"benchmark {word!r} is unknown; use some of: {known}")
        names |= dict.fromkeys(named)
    return list(names)
