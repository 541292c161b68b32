"""The registry of all benchmarks, by name."""

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

from benchmarks.adversaries import bench_adversaries
from benchmarks.airsim import bench_airsim
from benchmarks.airsim_chapter import bench_airsim_chapter
from benchmarks.airsim_scripts import bench_scripts
from benchmarks.benchmark import Benchmark, Figures, Setup
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
from benchmarks.inputs.claims import bench_inputs
from benchmarks.inputs.goal import bench_goal, bench_goal_flight
from benchmarks.inputs.rates import bench_input_rates
from benchmarks.maps import bench_maps
from benchmarks.memory import bench_memory
from benchmarks.onnx_export import bench_onnx
from benchmarks.original import bench_original
from benchmarks.own_task.measuring import bench_tasks
from benchmarks.peers.comparison import bench_peers
from benchmarks.proving import bench_provable, bench_prove
from benchmarks.render_truth import bench_render_truth
from benchmarks.revisions import bench_revisions
from benchmarks.robust import bench_robust
from benchmarks.scaling import bench_scaling
from benchmarks.shifts import bench_shifts
from benchmarks.speed import bench_collector, bench_dm_control, bench_render
from benchmarks.startup import bench_startup
from benchmarks.sweeps import bench_kills, bench_sweeps
from benchmarks.training import bench_large, bench_presets, bench_seeds, bench_solve
from benchmarks.verdicts import bench_verdicts
from benchmarks.worlds.commands import bench_world_commands
from benchmarks.worlds.contacts import bench_contacts
from benchmarks.worlds.drawing import bench_drawing
from benchmarks.worlds.hostile import bench_hostile
from benchmarks.worlds.judging import bench_world_judging
from benchmarks.worlds.strangers import bench_strangers
from benchmarks.worlds.training import bench_world_training
from drone_rl.utils.errors import InputError

_RENDERING = ("sim", "envs")
_COLLECTING = (*_RENDERING, "policies", "collectors")
_TRAINING = (*_COLLECTING, "objectives", "training", "conf")
_SOLVING = (*_TRAINING, "trust")
_JUDGING = (*_RENDERING, "policies", "trust")
_PROVING = (*_RENDERING, "policies", "verification/prover", "verification/checker")
_EXPLAINING = (*_JUDGING, "explanations")
_COMMANDS = (*_TRAINING, "config", "cli")


def _benchmark(
    run: Callable[..., Figures], group: str, *measures: str, **options: Any
) -> Benchmark:
    """Return a benchmark that measures packages, and the module of its own function.

    Args:
        run: Takes a `Setup` and the options; see `Benchmark`.
        group: See `Benchmark`.
        measures: See `Benchmark`.
        options: Further arguments of `run`.
    """
    module = run.__module__.replace(".", "/")
    return Benchmark(partial(run, **options), group, (*measures, module))


def _parts(*names: str) -> tuple[str, ...]:
    """Return further modules of benchmarks as entries of `Benchmark.measures`."""
    return tuple(f"benchmarks/{name}" for name in names)


def _bench_airsim(setup: Setup) -> Figures:
    return {
        **bench_airsim(setup.runs / "airsim", setup.quick),
        **bench_scripts(setup.runs / "airsim_scripts"),
        **bench_airsim_chapter(setup.runs / "airsim_chapter", setup.quick),
    }


BENCHMARKS: dict[str, Benchmark] = {
    "render": _benchmark(bench_render, "main", *_RENDERING),
    "collector": _benchmark(bench_collector, "main", *_COLLECTING),
    "dm_control": _benchmark(bench_dm_control, "main", *_RENDERING, *_parts("dm_control")),
    "scaling": _benchmark(bench_scaling, "main", *_RENDERING),
    "memory": _benchmark(bench_memory, "main", *_TRAINING),
    "solve": _benchmark(bench_solve, "main", *_SOLVING),
    "seeds": _benchmark(bench_seeds, "main", *_SOLVING),
    "large": _benchmark(bench_large, "main", *_TRAINING),
    "coverage": _benchmark(
        bench_coverage,
        "adversarial",
        "utils/intervals",
        "trust",
        *_parts("simulated_policies"),
    ),
    "gamed": _benchmark(
        bench_gamed,
        "adversarial",
        *_JUDGING,
        "verification",
        *_parts("gamed_memory", "gamed_rounding", "gamed_certificates"),
    ),
    "adversaries": _benchmark(bench_adversaries, "adversarial", *_JUDGING),
    "maps": _benchmark(
        bench_maps,
        "adversarial",
        *_EXPLAINING,
        *_parts("adversarial_maps", "known_map_policies"),
    ),
    "explain": _benchmark(bench_explain, "adversarial", *_EXPLAINING, "conf"),
    "verdicts": _benchmark(bench_verdicts, "adversarial", *_JUDGING, *_parts("scripted_policies")),
    "fragile_honest": _benchmark(bench_fragile_honest, "adversarial", *_TRAINING, *_JUDGING),
    "shifts": _benchmark(bench_shifts, "adversarial", *_JUDGING),
    "domain_axes": _benchmark(bench_domain_axes, "adversarial", *_JUDGING),
    "robust": _benchmark(bench_robust, "adversarial", *_SOLVING, *_parts("robust_comparison")),
    "render_truth": _benchmark(
        bench_render_truth, "adversarial", "sim/rendering", *_parts("random_scenes")
    ),
    "sweeps": _benchmark(bench_sweeps, "parallel", *_TRAINING, "sweeps"),
    "kills": _benchmark(bench_kills, "parallel", *_TRAINING, "sweeps"),
    "prove": _benchmark(bench_prove, "verification", *_PROVING),
    "exact_coverage": _benchmark(
        bench_exact_coverage, "verification", *_TRAINING, *_PROVING, "trust"
    ),
    "provable": _benchmark(bench_provable, "verification", *_TRAINING, *_PROVING),
    "presets": _benchmark(bench_presets, "several_inputs", *_SOLVING),
    "revisions": _benchmark(bench_revisions, "system", *_COMMANDS, "trust", "explanations"),
    "imitation": _benchmark(bench_imitation, "long", *_SOLVING),
    "original": _benchmark(bench_original, "long", *_TRAINING),
    "chapter": _benchmark(bench_chapter, "long", *_TRAINING, "acceleration", "flight/commands"),
    "fly_page": _benchmark(bench_fly_page, "flight", *_RENDERING, "flight", "policies"),
    "airsim": _benchmark(
        _bench_airsim,
        "flight",
        *_RENDERING,
        "flight",
        *_parts("airsim", "airsim_scripts", "airsim_chapter", "airsim_programs"),
    ),
    "tasks": _benchmark(
        bench_tasks, "system", *_COMMANDS, "trust", "explanations", *_parts("own_task", "maps")
    ),
    "inputs": _benchmark(bench_inputs, "several_inputs", *_EXPLAINING, *_parts("inputs")),
    "input_rates": _benchmark(bench_input_rates, "several_inputs", *_COLLECTING, "acceleration"),
    "goal": _benchmark(bench_goal, "several_inputs", *_SOLVING),
    "goal_flight": _benchmark(bench_goal_flight, "several_inputs", *_SOLVING),
    "world_drawing": _benchmark(
        bench_drawing, "worlds", *_COLLECTING, "acceleration", *_parts("worlds/house")
    ),
    "world_contacts": _benchmark(bench_contacts, "worlds", "sim"),
    "world_hostile": _benchmark(bench_hostile, "worlds", "sim/scenes", "utils/limits"),
    "world_training": _benchmark(bench_world_training, "worlds", *_SOLVING, "acceleration"),
    "world_judging": _benchmark(
        bench_world_judging, "worlds", *_EXPLAINING, *_parts("maps", "worlds/training")
    ),
    "world_commands": _benchmark(
        bench_world_commands,
        "worlds",
        *_COMMANDS,
        *("trust", "explanations", "flight"),
        *_parts("worlds"),
    ),
    "world_strangers": _benchmark(bench_strangers, "worlds", *_RENDERING),
    "startup": _benchmark(bench_startup, "system", *_COMMANDS, "trust"),
    "onnx": _benchmark(bench_onnx, "libraries", *_JUDGING),
    "peers": _benchmark(bench_peers, "libraries", *_COMMANDS, *_parts("peers")),
    "gymnasium": _benchmark(bench_gymnasium, "libraries", *_RENDERING),
    "flight_speed": _benchmark(bench_flight_speed, "flight", *_COLLECTING),
    "flight_parity": _benchmark(bench_flight_parity, "flight", "sim", *_parts("forces_kernel")),
    "flight_paths": _benchmark(bench_flight_paths, "flight", "sim", "flight/commands"),
}
GROUPS = tuple(dict.fromkeys(benchmark.group for benchmark in BENCHMARKS.values()))
"""Names of groups of benchmarks: main (speed and training), adversarial (correctness of claims),
parallel (sweeps), verification, libraries (third-party software), system (revisions and start-up
time), several_inputs (policies with them), worlds (scenes from files), long (trainings of hours),
flight (vehicle dynamics)."""


def find_benchmarks(names: Iterable[str]) -> list[str]:
    """Return the benchmarks of some names and groups, each once, in the order of the arguments.

    Args:
        names: Names of benchmarks and of groups.

    Raises:
        InputError: A name is neither a benchmark's nor a group's.
    """
    selected: dict[str, None] = {}
    for name in names:
        matches = [n for n, b in BENCHMARKS.items() if name in (n, b.group)]
        if not matches:
            options = ", ".join((*GROUPS, *BENCHMARKS))
            raise InputError(f"benchmark {name!r} is unknown; use some of: {options}")
        selected |= dict.fromkeys(matches)
    return list(selected)
