"""`drone-rl chain`: exact success probabilities of a policy that samples its actions."""

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, ClassVar

import torch
from torch import Tensor

from drone_rl.config import TaskSettings
from drone_rl.config.commands import ChanceSettings
from drone_rl.config.configuration import from_arguments
from drone_rl.policies.policy import Policy, load_policy
from drone_rl.sim.tasks.collect_cubes import CollectCubes, CubesEnd
from drone_rl.utils.display import TableResult
from drone_rl.utils.errors import InputError
from drone_rl.utils.models import Seeded, Stored
from drone_rl.utils.progress import Progress, as_progress
from drone_rl.utils.provenance import Provenance, provenance
from drone_rl.utils.seeding import RootSeed, Stream, with_seed, world_random_state
from drone_rl.utils.text import exact_percent, plural
from drone_rl.verification.prover.lattice import explore, shape_of
from drone_rl.verification.prover.markov_chain import NodeEvaluator, Outcomes, propagate
from drone_rl.verification.requirements import require_cubes

NODES_AT_A_TIME = 2**20  # lattice nodes of placements that are explored together; bounds memory
_ENDS = ("front_boundary", "side_boundary", "step_limit")


class EndChance(Stored):
    """One end of an episode."""

    reason: str
    collected: tuple[bool, ...]
    """Whether each cube is collected by then."""
    probability: float


class PlacementChances(Stored):
    """How episodes from one placement end: exact probabilities, not estimates."""

    cubes: tuple[tuple[float, float, float], ...]
    """Positions, metres, world frame, nearest cube first."""
    success: float
    """Probability that all cubes are collected."""
    failure: float
    """Probability that they are not, precise even if tiny."""
    mean_cubes: float
    mean_length: float
    """Expected number of steps."""
    undecided: float
    """Probability of episodes that are not followed to their end."""
    ends: tuple[EndChance, ...]

    def collected(self, cube: int) -> float:
        """Return the probability that a cube is collected."""
        return sum(end.probability for end in self.ends if end.collected[cube])

    def ended(self, reason: str) -> float:
        """Return the probability of an end, such as "step_limit"."""
        return sum(end.probability for end in self.ends if end.reason == reason)


class Chances(TableResult, Seeded, Provenance):
    """How episodes with sampled actions end; as in `chances.json`."""

    policy: str
    """Its name."""
    path: str
    task: dict[str, Any]
    """Settings of the task."""
    success: float
    """Mean probability over placements that all cubes are collected."""
    pictures: int
    """Number of images rendered."""
    placements: tuple[PlacementChances, ...]
    are_numbers: ClassVar[bool] = True

    @property
    def worst(self) -> list[float]:
        """The placement with the largest failure probability, metres to the left."""
        return [y for _, y, _ in max(self.placements, key=lambda p: p.failure).cubes]

    def rows(self) -> list[list[str]]:
        """Return a table: a header, then mean, minimum and maximum over placements."""
        every = self.placements
        rows = [
            ["", "mean", "least", "most"],
            _row("all cubes", [p.success for p in every]),
            _row("not all cubes", [p.failure for p in every]),
            _row("mean cubes", [p.mean_cubes for p in every], "{:.4f}".format),
            *(
                _row(f"cube {i + 1} collected", [p.collected(i) for p in every])
                for i in range(len(every[0].cubes))
            ),
            *(
                _row(f"ended: {end.replace('_', ' ')}", [p.ended(end) for p in every])
                for end in _ENDS
            ),
            _row("mean length", [p.mean_length for p in every], "{:.2f}".format),
            _row("undecided", [p.undecided for p in every]),
        ]
        return rows if len(every) > 1 else [["", "chance"], *(row[:2] for row in rows[1:])]

    def save(self, path: Path) -> None:
        """Write `chances.json`."""
        self.write_json(path)

    def notes(self) -> list[str]:
        """Return the lines below the table."""
        worst = ", ".join(f"{y:.6g}" for y in self.worst)
        count = plural(len(self.placements), "placement")
        about = f"{count}; success is least probable at cubes=[{worst}]"
        if self.seed is None:  # given placements have none
            return [about]
        lines = about, self.seed_warning("placements"), self.seed_line("placements")
        return [line for line in lines if line]


def chances(
    policy: str | Path | Policy,
    cubes: Sequence[float] | Sequence[Sequence[float]] | Tensor | None = None,
    settings: ChanceSettings | None = None,
    *,
    task: Mapping[str, Any] | None = None,
    outputs: str | Path = "outputs",
    progress: Progress | None = None,
    **changes: Any,
) -> Chances:
    """Compute the exact probability of each end of an episode with sampled actions, as in training.

    Each drone position that is reached with a probability above `MIN_PROBABILITY` is rendered once;
    the rest is arithmetic in float64, the network in float32. What is not followed is undecided.

    Args:
        policy: The policy, or an argument of `load_policy`.
        cubes: Positions of the cubes, metres to the left, nearest first, in one placement or
            several; held-out placements by default. Shape: (C,) or (P, C).
        settings: Device, renderer, and placements if `cubes` is None.
        task: Changes to the policy's task.
        outputs: Folder of runs.
        progress: Called with the progress; a bar by default.
        changes: Changes to the settings, as in `chances("good", placements=20)`.

    Raises:
        InputError: An input is unusable, `require_cubes` refuses the policy, or the task has too
            many nodes.
    """
    settings, seed = with_seed(from_arguments(ChanceSettings, settings, changes, chances))
    progress = as_progress(progress)
    policy = load_policy(policy, outputs=outputs).in_task(task)
    task_settings = require_cubes(policy.description, "exact probabilities")
    placed = (
        _sampled(task_settings, settings.placements, seed)
        if cubes is None
        else _given(task_settings, cubes)
    )
    at_a_time = max(1, NODES_AT_A_TIME // math.prod(shape_of(task_settings)))
    with closing(policy.make_env(1, device=settings.device, renderer=settings.renderer)) as env:
        evaluator, outcomes = NodeEvaluator(env, policy.make_network(settings.device)), []
        for part in placed.split(at_a_time):
            progress("placements", sum(map(len, outcomes)), len(placed))
            graph = explore(task_settings, part)
            outcomes.append(propagate(graph, evaluator.on(graph)))
    progress("placements", len(placed), len(placed))
    joined = Outcomes.joined(outcomes)
    return Chances(
        policy=policy.name,
        path=str(policy.path),
        task=policy.task.values(),
        success=float(joined.success.mean()),
        pictures=evaluator.num_images,
        placements=tuple(_placement(placed[i], joined, i) for i in range(len(placed))),
        **seed.as_dict() if cubes is None else {},
        **provenance(),
    )


def _placement(cubes: Tensor, outcomes: Outcomes, i: int) -> PlacementChances:
    ends = outcomes.ends[i]
    return PlacementChances(
        cubes=tuple(map(tuple, cubes.tolist())),
        success=float(outcomes.success[i]),
        failure=float(outcomes.failure[i]),
        mean_cubes=float(outcomes.cubes[i]),
        mean_length=float(outcomes.steps[i]),
        undecided=float(outcomes.undecided[i]),
        ends=tuple(
            EndChance(
                reason=CubesEnd(reason).name.lower(),
                collected=tuple(bool(bits >> k & 1) for k in range(len(cubes))),
                probability=float(ends[reason, bits]),
            )
            for reason, bits in ends.nonzero().tolist()
        ),
    )


def _sampled(task: TaskSettings, count: int, seed: RootSeed) -> Tensor:
    """Return the first placement of each of `count` held-out environments."""
    streams = (world_random_state(seed.value, env, Stream.REPORT) for env in range(count))
    return torch.stack([CollectCubes(task).sample(stream) for stream in streams])


def _given(task: TaskSettings, cubes: Any) -> Tensor:
    """Return placements (P, C, 3) from metres to the left; cubes are at the drone's altitude."""
    try:
        aside = torch.atleast_2d(torch.as_tensor(cubes, dtype=torch.float64))
    except (TypeError, ValueError, RuntimeError):
        aside = torch.empty(0, 0)
    is_inside = bool((aside.abs() <= task.lateral_bound).all())
    if not len(aside) or aside[0].shape != (task.num_cubes,) or not is_inside:
        raise InputError(
            f"cubes={cubes} must have {task.num_cubes} positions; give metres to the left, nearest "
            f"first, from -{task.lateral_bound:g} to {task.lateral_bound:g} (task.lateral_bound)"
        )
    ahead = task.first_distance + task.spacing * torch.arange(task.num_cubes).double()
    return torch.stack(
        [ahead.expand_as(aside), aside, torch.full_like(aside, task.altitude)], dim=-1
    )


def _row(name: str, values: list[float], show: Callable[[float], str] = exact_percent) -> list[str]:
    return [name, *map(show, (sum(values) / len(values), min(values), max(values)))]
