"""Check a certificate: it must be consistent, and simulated episodes must end as stated."""

import dataclasses
from collections.abc import Callable, Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from pydantic import computed_field
from tensordict import TensorDict
from torch import Tensor

from drone_rl.envs import base_env, worlds_of
from drone_rl.policies.zoo import PolicyDescription
from drone_rl.sim.tasks import State
from drone_rl.sim.tasks.collect_cubes import CubesEnd
from drone_rl.sim.tasks.objects import ObjectState
from drone_rl.utils.errors import InputError
from drone_rl.utils.models import Stored
from drone_rl.verification.checker.certificate import (
    Certificate,
    Outcome,
    check_same_policy,
    ending_text,
    read_certificate,
)
from drone_rl.verification.checker.consistency import (
    find_inconsistencies,
    find_wrong_step_counts,
    missing_steps,
)
from drone_rl.verification.checker.sampling import ANYWHERE, sample_placements
from drone_rl.verification.requirements import require_cubes

MAX_KEPT = 20  # contradictions that are described
MAX_BATCH_SIZE = 1024  # episodes per batch
MAX_PIXELS = 2**22  # pixels per batch of images
_SHORT_LOOP = 2  # up to so many repetitions, a loop need not be stated as one
ProgressCallback = Callable[[int, int], None]  # called with the number done, and of all


class Contradiction(Stored):
    """An episode that ended otherwise than stated."""

    where: str
    """Why it was simulated, see `sampling.Placements.why`."""
    placement: tuple[float, ...]
    """Metres to the left of each cube."""
    stated: str
    found: str

    def __str__(self) -> str:
        return (
            f"from y={list(self.placement)} ({self.where}) the flight ended otherwise than "
            f"stated ({self.stated}): {self.found}"
        )


class CheckFindings(Stored):
    """The result of a check."""

    findings: tuple[str, ...]
    """Impossible or refuted statements, without single episodes."""
    contradictions: tuple[Contradiction, ...] = ()
    """The first episodes that ended otherwise than stated."""
    contradicted: int = 0
    """Number of such episodes."""
    flights: dict[str, int] = {}
    """Number of episodes, by why they were simulated."""

    @computed_field
    @property
    def wrong_at_most(self) -> float:
        """Upper bound on the fraction of placements with a wrong statement, with 95% confidence.

        A certificate that is wrong about more is refuted by the uniform episodes in at least 95% of
        cases.
        """
        uniform = self.flights.get(ANYWHERE, 0)
        return 1.0 - 0.05 ** (1.0 / uniform) if uniform else 1.0

    @computed_field
    @property
    def accepted(self) -> bool:
        """Whether nothing contradicts the certificate."""
        return not self.findings and not self.contradicted

    def lines(self) -> list[str]:
        """Return each finding in one line."""
        lines = [*self.findings, *map(str, self.contradictions)]
        more = self.contradicted - len(self.contradictions)
        return [*lines, f"and {more} flights more ended otherwise than stated"] if more else lines


@dataclasses.dataclass(frozen=True)
class EpisodeEnds:
    """How episodes ended; the first dimension counts episodes."""

    end: NDArray[np.int64]  # (k,); `CubesEnd`
    collected: NDArray[np.bool_]  # (k, cubes); whether each cube was collected
    steps: NDArray[np.int64]  # (k,); number of steps
    repeats: NDArray[np.int64]  # (k,); final steps whose state equals that of two steps before

    def name(self, i: int) -> str:
        """Return the name of the end of one episode, as in certificates."""
        return CubesEnd(self.end[i]).name.lower()


class Simulator:
    """Simulates a policy without memory."""

    def __init__(
        self,
        described: PolicyDescription,
        weights: Mapping[str, Tensor],
        device: str = "cpu",
        renderer: str = "raytrace",
    ) -> None:
        pixels = described.camera.width * described.camera.height
        self.batch_size = max(1, min(MAX_BATCH_SIZE, MAX_PIXELS // pixels))
        count = min(self.batch_size, 64)
        self._env = described.build_env(count, seed=0, device=device, renderer=renderer)
        self._worlds = worlds_of(self._env)
        self._task = require_cubes(described, "certificates")
        self._transforms = base_env(self._env).observer.image.transforms
        self._network = described.load_network(weights).to(self._worlds.device)

    def fly(
        self, placements: NDArray[np.float64], report: ProgressCallback = lambda done, total: None
    ) -> EpisodeEnds:
        """Simulate episodes in batches, from metres to the left of each cube (k, cubes)."""
        parts = [self._fly(placements[:0])]
        for first in range(0, len(placements), self.batch_size):
            parts.append(self._fly(placements[first : first + self.batch_size]))
            report(min(first + self.batch_size, len(placements)), len(placements))
        fields = zip(*(vars(part).values() for part in parts), strict=True)
        return EpisodeEnds(*map(np.concatenate, fields))

    def close(self) -> None:
        """Close the renderer."""
        self._env.close()

    @torch.no_grad()
    def _fly(self, placements: NDArray[np.float64]) -> EpisodeEnds:
        now: Any = self._start(torch.from_numpy(placements))  # worlds are of any task's state
        flying = torch.arange(len(now), device=self._worlds.device)
        done, before = now[flying], now
        repeats = torch.zeros_like(flying)
        while len(flying):
            earlier, before = before, now
            now, _ = self._worlds.advance(now, self._choose(now))
            is_same = self._is_same(earlier, now)
            done[flying], repeats[flying] = now, (repeats[flying] + 1) * is_same
            on = now.end_reason == 0
            flying, now, before = flying[on], now[on], before[on]
        ended = (done.end_reason, done.reached, done.steps, repeats)
        return EpisodeEnds(*(value.cpu().numpy() for value in ended))

    def _start(self, lateral: Tensor) -> State:
        """Return initial states with cubes at these positions."""
        task = self._task
        ahead = task.first_distance + task.spacing * torch.arange(task.num_cubes).double()
        up = torch.full_like(lateral, task.altitude)
        return self._worlds.start(torch.stack([ahead.expand_as(lateral), lateral, up], -1))

    def _choose(self, state: ObjectState) -> Tensor:
        """Return the argmax actions."""
        seen = TensorDict({"pixels": self._worlds.render(state)}, [len(state)])
        for transform in self._transforms:
            seen = transform(seen)
        return self._network(seen["pixels"]).argmax(-1)

    def _is_same(self, one: ObjectState, other: ObjectState) -> Tensor:
        """Return whether states are equal: same position, same cubes standing."""
        moved = (one.drone - other.drone).abs().amax(-1) > self._task.step_length / 2
        return ~moved & (one.present == other.present).all(-1)


def check_certificate(
    certificate: Certificate,
    weights: Mapping[str, torch.Tensor],
    *,
    flights: int = 2000,
    seed: int = 0,
    device: str = "cpu",
    renderer: str = "raytrace",
    report: ProgressCallback = lambda done, total: None,
) -> CheckFindings:
    """Check a certificate of a policy with these weights, see `check_same_policy`.

    An inconsistent certificate is refused without simulation. Else up to `flights` episodes are
    simulated; the seed is that of their placements, see `sample_placements`. Undecided placements
    are skipped. `report` is called with the number of episodes done, and of all.

    Raises:
        InputError: There is no such device.
    """
    if inconsistencies := tuple(find_inconsistencies(certificate)):
        return CheckFindings(findings=inconsistencies)
    sample = sample_placements(certificate, flights, np.random.default_rng(seed))
    stated = sample.outcome < len(certificate.outcomes)
    points, why = sample.points[stated], sample.why[stated]
    with closing(Simulator(certificate.policy.description, weights, device, renderer)) as simulator:
        rollouts = simulator.fly(points, report)
    outcomes = [certificate.outcomes[i] for i in sample.outcome[stated]]
    wrong = [i for i, outcome in enumerate(outcomes) if not ends_as_stated(outcome, rollouts, i)]
    steps = np.zeros_like(sample.outcome)
    steps[stated] = rollouts.steps
    anywhere = sample.why == ANYWHERE
    counts = find_wrong_step_counts(certificate.outcomes, sample.outcome[anywhere], steps[anywhere])
    kept = [
        Contradiction(
            where=str(why[i]),
            placement=tuple(points[i].tolist()),
            stated=_stated(outcomes[i]),
            found=_found(rollouts, i),
        )
        for i in wrong[:MAX_KEPT]
    ]
    kinds, counted = np.unique(why, return_counts=True)
    return CheckFindings(
        findings=tuple(counts),
        contradictions=tuple(kept),
        contradicted=len(wrong),
        flights=dict(zip(kinds.tolist(), counted.tolist(), strict=True)),
    )


def read_validated(
    path: Path, described: PolicyDescription, weights: Mapping[str, torch.Tensor]
) -> Certificate:
    """Read a certificate of this policy and task, and check its consistency without simulation.

    Raises:
        InputError: It can't be read, is of another policy or task, or is inconsistent.
    """
    certificate = read_certificate(path)
    check_same_policy(certificate, described, weights, described.task.parameters)
    if inconsistency := next(find_inconsistencies(certificate), None):
        raise InputError(f"certificate {path} is inconsistent: {inconsistency}; prove again")
    return certificate


def ends_as_stated(outcome: Outcome, rollouts: EpisodeEnds, i: int) -> bool:
    """Return whether episode i ended as stated, after a stated number of steps."""
    if (rollouts.name(i), tuple(rollouts.collected[i])) != (outcome.end, outcome.collected):
        return False
    if outcome.end == "step_limit":
        loops = rollouts.repeats[i] > (0 if outcome.loops else _SHORT_LOOP)
        if loops != outcome.loops:
            return False
    return int(rollouts.steps[i]) in outcome.steps or missing_steps(outcome) > 0


def _stated(outcome: Outcome) -> str:
    steps = ", ".join(map(str, sorted(outcome.steps)))
    return f"{outcome}" if missing_steps(outcome) else f"{outcome}, steps: {steps}"


def _found(rollouts: EpisodeEnds, i: int) -> str:
    collected = rollouts.collected[i].tolist()
    loops = rollouts.end[i] == CubesEnd.STEP_LIMIT and bool(rollouts.repeats[i])
    return f"{ending_text(rollouts.name(i), collected, loops)}, steps: {rollouts.steps[i]}"
