"""The exact chances of a policy that draws its moves, placement by placement."""

import dataclasses
import json
from collections.abc import Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from drone_rl.config import TaskSettings
from drone_rl.config.verification import ChanceSettings, ProveSettings
from drone_rl.policies.policy import Policy, load_policy
from drone_rl.sim.tasks.collect_cubes import CollectCubes, EndReason
from drone_rl.utils.display import aligned, paragraph, table
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import Bar, Progress
from drone_rl.utils.provenance import provenance
from drone_rl.utils.seeding import RootSeed, Stream, with_seed, world_random_state
from drone_rl.utils.text import CHANCES, say, seed_line
from drone_rl.verification.prover.lattice import explore, shape_of
from drone_rl.verification.prover.markov_chain import (
    Bounded,
    Outcomes,
    Sight,
    bound_success,
    follow_chances,
)
from drone_rl.verification.prover.policy_spec import make_subject
from drone_rl.verification.requirements import require_cubes, require_moves

_BOUNDS = {
    "least": "everywhere at least",
    "most": "everywhere at most",
    "mean_least": "on average at least",
    "mean_most": "on average at most",
}
CELLS_AT_A_TIME = 2**22
"""Bounds memory."""
PLACEMENTS_AT_A_TIME = 20
"""Between two words on progress."""


_WHAT = "the chance of each placement"


@dataclasses.dataclass(frozen=True)
class Chances:
    """How a policy's episodes end if it draws its moves: probabilities, not estimates."""

    policy: Policy
    cubes: Tensor  # (P, C, 3) float64
    """Placements, metres, world frame, nearest cube first."""
    outcomes: Outcomes
    """Of each placement."""
    pictures: int
    """How many were drawn."""
    within: float = 0.0
    """Metres to either side of each cube for which the bounds are."""
    bounded: tuple[Bounded, ...] = ()
    """Bounds on the success of each placement, wherever within these metres the cubes stand."""
    seed: RootSeed | None = None
    """Of held-out placements; None of given ones."""

    @property
    def success(self) -> float:
        """Probability that all cubes are collected; the mean of the placements."""
        return float(self.outcomes.success.mean())

    @property
    def worst(self) -> Tensor:
        """The placement in which that is least probable: metres to the left. Shape: (C,)."""
        return self.cubes[self.outcomes.failure.argmax(), :, 1]

    def rows(self) -> list[list[str]]:
        """The figures as texts: names, then a row for each; mean, least and most of placements."""
        told = self.outcomes
        rows = [["", "mean", "least", "most"], _row("all cubes", told.success, _percent)]
        rows.append(_row("not all cubes", told.failure, _percent))
        rows.append(_row("mean cubes", told.cubes, "{:.4f}".format))
        for i, collected in enumerate(told.collected.unbind(-1)):
            rows.append(_row(f"cube {i + 1} collected", collected, _percent))
        for reason in list(EndReason)[EndReason.FRONT_BOUNDARY : EndReason.LOST_CONTROL]:
            text = f"ended: {reason.name.lower().replace('_', ' ')}"
            rows.append(_row(text, told.reasons[:, reason], _percent))
        rows.append(_row("mean length", told.steps, "{:.2f}".format))
        rows.append(_row("undecided", told.undecided, _percent))
        for name, words in _BOUNDS.items() if self.bounded else ():
            bounds = torch.tensor([getattr(b, name) for b in self.bounded], dtype=torch.float64)
            rows.append(_row(f"within {self.within:g} m, {words}", bounds, _percent))
        return rows if len(self.cubes) > 1 else [["", "chance"], *(row[:2] for row in rows[1:])]

    def as_dict(self) -> dict[str, Any]:
        """Plain values, as in `chances.json`."""
        return {
            "policy": self.policy.name,
            "path": str(self.policy.path),
            "task": self.policy.task.values(),
            **({} if self.seed is None else self.seed.as_dict()),
            "success": self.success,
            "pictures": self.pictures,
            "placements": [self._placement(i) for i in range(len(self.cubes))],
            **provenance(),
        }

    def save(self, path: Path) -> None:
        """Writes `chances.json`."""
        path.write_text(json.dumps(self.as_dict(), indent=2))

    def __str__(self) -> str:
        """The table for a terminal."""
        return "\n".join([aligned(self.rows(), are_numbers=True), *self._notes()])

    def _repr_html_(self) -> str:
        head, *rows = self.rows()
        return table(head, rows) + "".join(map(paragraph, self._notes()))

    def _notes(self) -> list[str]:
        """Below the table."""
        if self.seed is None:
            return [self._about()]
        seed = self.seed.as_dict()
        notes = [self._about(), say(CHANCES, seed), seed_line(seed, "placements")]
        return [*filter(None, notes)]

    def _about(self) -> str:
        """Of what these are the figures."""
        if len(self.cubes) == 1:
            return f"cubes at {_places(self.cubes[0, :, 1])} metres to the left"
        least = f"least probable at cubes={_places(self.worst)}"
        return f"{len(self.cubes)} placements; {least}"

    def _placement(self, i: int) -> dict[str, Any]:
        told, ends = self.outcomes, self.outcomes.ends[i]
        count = self.cubes.shape[1]
        bounds = None
        if self.bounded:
            bounds = {"metres": self.within, **dataclasses.asdict(self.bounded[i])}
        return {
            "within": bounds,
            "cubes": self.cubes[i].tolist(),
            "success": float(told.success[i]),
            "failure": float(told.failure[i]),
            "mean_cubes": float(told.cubes[i]),
            "mean_length": float(told.steps[i]),
            "undecided": float(told.undecided[i]),
            "ends": [
                {
                    "reason": EndReason(reason).name.lower(),
                    "collected": [bool(cubes >> k & 1) for k in range(count)],
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
    **changes: Any,
) -> Chances:
    """How probable each end of an episode is if a policy draws its moves, as in training.

    Each place that the drone can come to is drawn once by the simulator's renderer, if that is not
    all but impossible; the rest is arithmetic in float64. What was left out is told as undecided.
    The policy's own network computes in float32.

    Args:
        policy: The policy, or what `load_policy` takes.
        cubes: Where they stand, metres to the left, nearest first, in one placement or several;
            held-out placements by default. Shape: (C,) or (P, C).
        settings: Which placements, where none is given.
        task: What to change of the policy's task.
        outputs: Folder under which runs are kept.
        progress: Told of what is being done; a bar by default.
        changes: Settings to change, as in `chances("good", placements=20)`.

    Raises:
        InputError: The policy, a setting or a place is unusable, the policy has a memory, or the
            task has too many nodes.
    """
    settings, seed = with_seed((settings or ChanceSettings()).replace(**changes))
    progress = progress or Bar()
    policy = policy if isinstance(policy, Policy) else load_policy(policy, outputs=outputs)
    policy = policy.in_task(**(task or {}))
    flown, described = require_cubes(policy.task, _WHAT), policy.description
    require_moves(described.dynamics, described.actions, _WHAT)
    placed = _drawn(flown, settings.placements, seed) if cubes is None else _given(flown, cubes)
    at_a_time = max(1, CELLS_AT_A_TIME // shape_of(flown).nodes)
    parts = placed.split(min(at_a_time, PLACEMENTS_AT_A_TIME))
    env = policy.make_env(1, device=settings.device, renderer=settings.renderer)
    try:
        sight, told = Sight(env, policy.make_network(settings.device)), []
        for part in parts:
            progress("placements", sum(map(len, told)), len(placed))
            graph = explore(flown, part)
            told.append(follow_chances(graph, sight.on(graph)))
    finally:
        env.close()
    progress("placements", len(placed), len(placed))
    bounded = _bounded(policy, placed, settings, progress) if settings.within else ()
    outcomes = Outcomes.joined(told)
    origin = seed if cubes is None else None
    return Chances(policy, placed, outcomes, sight.pictures, settings.within, bounded, origin)


def _bounded(
    policy: Policy, placed: Tensor, settings: ChanceSettings, progress: Progress
) -> tuple[Bounded, ...]:
    """Bounds around each placement, as far as cubes are placed at all."""
    network, gap = policy.make_network(), ProveSettings().logit_gap
    made = make_subject(policy.description, network, gap, settings.renderer)
    found: list[Bounded] = []
    with closing(made) as subject:
        bound = subject.lattice.task.lateral_bound
        for i, aside in enumerate(placed[..., 1].numpy()):
            progress("bounds", i, len(placed))
            box = np.stack([aside - settings.within, aside + settings.within], -1)
            found.append(bound_success(subject, box.clip(-bound, bound), settings.parts))
    progress("bounds", len(placed), len(placed))
    return tuple(found)


def _drawn(task: TaskSettings, count: int, seed: RootSeed) -> Tensor:
    """The first placement of each of so many held-out worlds."""
    worlds = range(count)
    streams = (world_random_state(seed.value, world, Stream.REPORT) for world in worlds)
    return torch.stack([CollectCubes(task).draw(stream) for stream in streams])


def _given(task: TaskSettings, cubes: Any) -> Tensor:
    """Placements by their metres to the left, at the drone's altitude."""
    try:
        aside = torch.atleast_2d(torch.as_tensor(cubes, dtype=torch.float64))
    except (TypeError, ValueError, RuntimeError):
        raise InputError(f"cubes={cubes} are no numbers; give metres to the left") from None
    if aside.ndim != 2 or not len(aside) or aside.shape[1] != task.num_cubes:
        raise InputError(
            f"cubes={cubes} must place {task.num_cubes}; give so many metres to the left, nearest "
            "first, or change task.num_cubes"
        )
    if not (aside.abs() <= task.lateral_bound).all():
        raise InputError(
            f"cubes={cubes} stand where the task puts none; give metres to the left from "
            f"-{task.lateral_bound:g} to {task.lateral_bound:g} (task.lateral_bound)"
        )
    ahead = task.first_distance + task.spacing * torch.arange(task.num_cubes).double()
    return torch.stack(
        [ahead.expand_as(aside), aside, torch.full_like(aside, task.altitude)], dim=-1
    )


def _row(name: str, values: Tensor, show: Any) -> list[str]:
    figures = (values.mean(), values.min(), values.max())
    return [name, *(show(float(figure)) for figure in figures)]


def _percent(share: float) -> str:
    return f"{100 * share:.4g}%"


def _places(aside: Tensor) -> str:
    return f"[{', '.join(f'{y:.6g}' for y in aside.tolist())}]"
