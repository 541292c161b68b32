"""`drone-rl chain`: exact success probabilities of a policy that samples its actions."""

import dataclasses
import json
import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, Unpack

import numpy as np
import torch
from torch import Tensor

from drone_rl.config import TaskSettings
from drone_rl.config.commands import ChanceSettings, ProveSettings
from drone_rl.config.configuration import as_changes, from_arguments
from drone_rl.config.options import ChanceOptions
from drone_rl.policies.policy import Policy, load_policy
from drone_rl.sim.tasks.collect_cubes import CollectCubes, CubesEnd
from drone_rl.utils.display import TableResult
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import Progress, as_progress
from drone_rl.utils.provenance import provenance
from drone_rl.utils.seeding import RootSeed, Stream, with_seed, world_random_state
from drone_rl.utils.text import CHANCES, exact_percent, plural, say, seed_line
from drone_rl.verification.prover.lattice import explore, shape_of
from drone_rl.verification.prover.markov_chain import (
    NodeEvaluator,
    Outcomes,
    SuccessBounds,
    bound_success,
    propagate,
)
from drone_rl.verification.prover.policy_spec import make_policy_spec
from drone_rl.verification.requirements import require_cubes

_BOUNDS = {
    "least": "everywhere at least",
    "most": "everywhere at most",
    "mean_least": "on average at least",
    "mean_most": "on average at most",
}
NODES_AT_A_TIME = 2**20  # lattice nodes of placements that are explored together; bounds memory


@dataclasses.dataclass(frozen=True)
class Chances(TableResult):
    """How episodes with sampled actions end: exact probabilities, not estimates."""

    policy: Policy
    cubes: Tensor  # (P, C, 3) float64
    """Placements, metres, world frame, nearest cube first."""
    outcomes: Outcomes
    """For each placement."""
    num_images: int
    """Number of images rendered."""
    within: float = 0.0
    """Half-width of the boxes around each placement that the bounds cover, metres."""
    bounded: tuple[SuccessBounds, ...] = ()
    """Bounds on the success probability of each placement over its box."""
    seed: RootSeed | None = None
    """Root seed of held-out placements; None of given ones."""
    are_numbers = True

    @property
    def success(self) -> float:
        """Mean probability over placements that all cubes are collected."""
        return float(self.outcomes.success.mean())

    @property
    def worst(self) -> Tensor:
        """The placement with the largest failure probability, metres to the left. Shape: (C,)."""
        return self.cubes[self.outcomes.failure.argmax(), :, 1]

    def rows(self) -> list[list[str]]:
        """Return a table: a header, then mean, minimum and maximum over placements."""
        outcomes, collected = self.outcomes, self.outcomes.collected.unbind(-1)
        reasons = (CubesEnd.FRONT_BOUNDARY, CubesEnd.SIDE_BOUNDARY, CubesEnd.STEP_LIMIT)
        rows = [
            ["", "mean", "least", "most"],
            _row("all cubes", outcomes.success),
            _row("not all cubes", outcomes.failure),
            _row("mean cubes", outcomes.cubes, "{:.4f}".format),
            *(_row(f"cube {i} collected", share) for i, share in enumerate(collected, 1)),
            *(
                _row(f"ended: {end.name.lower().replace('_', ' ')}", outcomes.reasons[:, end])
                for end in reasons
            ),
            _row("mean length", outcomes.steps, "{:.2f}".format),
            _row("undecided", outcomes.undecided),
        ]
        for name, words in _BOUNDS.items() if self.bounded else ():
            bounds = torch.tensor([getattr(b, name) for b in self.bounded], dtype=torch.float64)
            rows.append(_row(f"within {self.within:g} m, {words}", bounds))
        return rows if len(self.cubes) > 1 else [["", "chance"], *(row[:2] for row in rows[1:])]

    def as_dict(self) -> dict[str, Any]:
        """Return plain values, as in `chances.json`."""
        return {
            "policy": self.policy.name,
            "path": str(self.policy.path),
            "task": self.policy.task.values(),
            **({} if self.seed is None else self.seed.as_dict()),
            "success": self.success,
            "pictures": self.num_images,
            "placements": [self._placement(i) for i in range(len(self.cubes))],
            **provenance(),
        }

    def save(self, path: Path) -> None:
        """Write `chances.json`."""
        path.write_text(json.dumps(self.as_dict(), indent=2))

    def notes(self) -> list[str]:
        """Return the lines below the table."""
        worst = ", ".join(f"{y:.6g}" for y in self.worst.tolist())
        about = (
            f"{plural(len(self.cubes), 'placement')}; success is least probable at cubes=[{worst}]"
        )
        if self.seed is None:
            return [about]
        seed = self.seed.as_dict()
        return [*filter(None, [about, say(CHANCES, seed), seed_line(seed, "placements")])]

    def _placement(self, i: int) -> dict[str, Any]:
        outcomes, ends, bounds = self.outcomes, self.outcomes.ends[i], None
        if self.bounded:
            bounds = {"metres": self.within, **dataclasses.asdict(self.bounded[i])}
        return {
            "within": bounds,
            "cubes": self.cubes[i].tolist(),
            "success": float(outcomes.success[i]),
            "failure": float(outcomes.failure[i]),
            "mean_cubes": float(outcomes.cubes[i]),
            "mean_length": float(outcomes.steps[i]),
            "undecided": float(outcomes.undecided[i]),
            "ends": [
                {
                    "reason": CubesEnd(reason).name.lower(),
                    "collected": [bool(cubes >> k & 1) for k in range(self.cubes.shape[1])],
                    "probability": float(ends[reason, cubes]),
                }
                for reason, cubes in ends.nonzero().tolist()
            ],
        }


def chances(
    policy: str | Path | Policy,
    cubes: Sequence[float] | Sequence[Sequence[float]] | Tensor | None = None,
    settings: ChanceSettings | None = None,
    *,
    task: Mapping[str, Any] | None = None,
    outputs: str | Path = "outputs",
    progress: Progress | None = None,
    **changes: Unpack[ChanceOptions],
) -> Chances:
    """Compute the exact probability of each end of an episode with sampled actions, as in training.

    Each drone position that is reached with a probability above `MIN_PROBABILITY` is rendered once;
    the rest is arithmetic in float64, the network in float32. What is not followed is undecided.

    Args:
        policy: The policy, or an argument of `load_policy`.
        cubes: Positions of the cubes, metres to the left, nearest first, in one placement or
            several; held-out placements by default. Shape: (C,) or (P, C).
        settings: Device, renderer, box of the bounds, and placements if `cubes` is None.
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
    policy = load_policy(policy, outputs=outputs).in_task(**as_changes(task, "task"))
    task_settings = require_cubes(policy.description, "exact probabilities")
    placed = (
        _sampled(task_settings, settings.placements, seed)
        if cubes is None
        else _given(task_settings, cubes)
    )
    bounded = _bounded(policy, placed, settings, progress) if settings.within else ()
    at_a_time = max(1, NODES_AT_A_TIME // math.prod(shape_of(task_settings)))
    with closing(policy.make_env(1, device=settings.device, renderer=settings.renderer)) as env:
        evaluator, outcomes = NodeEvaluator(env, policy.make_network(settings.device)), []
        for part in placed.split(at_a_time):
            progress("placements", sum(map(len, outcomes)), len(placed))
            graph = explore(task_settings, part)
            outcomes.append(propagate(graph, evaluator.on(graph)))
    progress("placements", len(placed), len(placed))
    return Chances(
        policy,
        placed,
        Outcomes.joined(outcomes),
        evaluator.num_images,
        settings.within,
        bounded,
        seed if cubes is None else None,
    )


def _bounded(
    policy: Policy, placed: Tensor, settings: ChanceSettings, progress: Progress
) -> tuple[SuccessBounds, ...]:
    """Bound the success probability over a box around each placement, within the lateral bound."""
    network, gap = policy.make_network(), ProveSettings().logit_gap
    bounds: list[SuccessBounds] = []
    spec = make_policy_spec(policy.description, network, gap, settings.renderer)
    with closing(spec):
        bound = spec.lattice.task.lateral_bound
        for i, aside in enumerate(placed[..., 1].numpy()):
            progress("bounds", i, len(placed))
            box = np.stack([aside - settings.within, aside + settings.within], -1)
            bounds.append(bound_success(spec, box.clip(-bound, bound), settings.parts))
    return tuple(bounds)


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


def _row(name: str, values: Tensor, show: Callable[[float], str] = exact_percent) -> list[str]:
    return [name, *(show(float(figure)) for figure in (values.mean(), values.min(), values.max()))]
