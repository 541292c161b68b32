"""Find and check the certificate of a policy, and compare it with a verdict's episodes."""

import dataclasses
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drone_rl.collectors.complete_episodes import CompleteEpisodes
from drone_rl.config.commands import JudgeSettings
from drone_rl.policies.policy import BasePolicy, Policy
from drone_rl.policies.zoo import certificate_path
from drone_rl.sim.tasks.collect_cubes import CubesEnd
from drone_rl.trust.results import Proof
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import RootSeed, root_seed
from drone_rl.verification.checker.certificate import Certificate, certificate_file
from drone_rl.verification.checker.checker import check_certificate, read_validated
from drone_rl.verification.checker.sampling import ANYWHERE, find

_ROUNDING = 2.0**-24
"""Largest relative error of a number that is rounded to float32."""


@dataclasses.dataclass(frozen=True)
class Claim:
    """A certificate that was found and checked, or the reason why it is refused."""

    path: Path
    """Its file."""
    certificate: Certificate | None
    """See `drone_rl.verification.checker.checker.read_validated`; None if it was refused."""
    refused: str | None = None
    """The reason, in one line."""
    flights: int = 0
    """Rollouts that re-checked it, all of which ended as it states; 0 if none were."""
    uniform: int = 0
    """Those of them from uniformly sampled placements."""
    seed: int | None = None
    """Of the placements."""
    seed_is_fixed: bool = True
    """Whether the seed was chosen, so that a certificate could have been fitted to it."""

    @property
    def wrong_at_most(self) -> float | None:
        """Upper bound on the fraction of placements with a wrong statement, with 95% confidence.

        A certificate that is wrong about more passes so many uniform rollouts with a probability
        of at most 5%. None without rollouts.
        """
        return 1.0 - 0.05 ** (1.0 / self.uniform) if self.uniform else None

    def quote(self, greedy: CompleteEpisodes) -> Proof:
        """Return what a verdict may quote: nothing if an episode contradicts the certificate."""
        stated = self.certificate
        if stated is None:
            return Proof(refused=self.refused)
        held = _ends_as_stated(stated, greedy)
        if not all(held):
            count = f"{len(held) - sum(held)} of {len(held)} greedy flights of this verdict"
            return Proof(refused=f"{count} ended otherwise than it states")
        return Proof(
            every=stated.is_proved,
            share=stated.success,
            lost=stated.lost,
            undecided=stated.undecided.share,
            finished=stated.finished,
            checked=self.flights,
            wrong_at_most=self.wrong_at_most,
            seed=self.seed,
            seed_is_fixed=self.seed_is_fixed,
            agreeing=len(held),
        )


def find_claim(
    policy: BasePolicy,
    certificate: str | Path | None = None,
    *,
    flights: int = JudgeSettings().certificate_flights,
    seed: RootSeed | None = None,
    device: str = "cpu",
    renderer: str = "raytrace",
) -> Claim | None:
    """Find and check the certificate of a policy in its task, see `checker.read_validated`.

    It is the given file or the certificate.json of the given folder, by default the file next to
    the policy, see `drone_rl.policies.zoo.certificate_path`. Rollouts from so many other
    placements, by default of a fresh seed, re-check it.
    Return None if there is none; an invalid one next to the policy is returned as refused.

    Raises:
        InputError: The given one is unreadable, of another network or task, or refuted.
    """
    if not isinstance(policy, Policy):
        if certificate is not None:
            raise InputError(
                f"certificate={certificate}, but policy={policy.name} was made elsewhere, and "
                "nothing is proved of it; leave the certificate out"
            )
        return None
    seed = seed or root_seed(None)
    if certificate is not None:
        path = certificate_file(certificate)
        return _read_and_check(policy, path, flights, seed, device, renderer)
    path = certificate_path(policy.path)
    if not path.is_file():
        return None
    try:
        return _read_and_check(policy, path, flights, seed, device, renderer)
    except InputError as error:
        return Claim(path, None, refused=str(error))


def _outcomes_of(stated: Certificate, episodes: CompleteEpisodes) -> NDArray[np.int64]:
    """Index of each episode's outcome; the number of outcomes where none is stated.

    Episodes record placements in float32. Where that leaves open which of two outcomes is stated,
    none counts as stated.
    """
    groups, places = stated.groups, episodes.goals.world.reshape(len(episodes), -1, 3)  # x, y, z
    boxes, bound = np.concatenate(groups), stated.task.lateral_bound
    owner = np.repeat(np.arange(len(groups)), [len(boxes) for boxes in groups])
    y = places[..., 1].double().numpy()
    ends = (y - _ROUNDING * abs(y), y + _ROUNDING * abs(y))
    low, high = (owner[find(boxes, end.clip(-bound, bound))] for end in ends)
    return np.where(low == high, low, len(stated.outcomes))


def _ends_as_stated(stated: Certificate, greedy: CompleteEpisodes) -> list[bool]:
    """For each episode with a stated end, whether it ended so."""
    outcome = _outcomes_of(stated, greedy)
    ended = zip(outcome, greedy.end_reason.tolist(), greedy.goals.reached.tolist(), strict=True)
    return [
        (CubesEnd(end).name.lower(), tuple(reached))
        == (stated.outcomes[i].end, stated.outcomes[i].collected)
        for i, end, reached in ended
        if i < len(stated.outcomes)
    ]


def _read_and_check(
    policy: Policy, path: Path, flights: int, seed: RootSeed, device: str, renderer: str
) -> Claim:
    weights = policy.state["policy"]
    certificate = read_validated(path, policy.description, weights)
    if not flights:
        return Claim(path, certificate)
    findings = check_certificate(
        certificate, weights, flights=flights, seed=seed.value, device=device, renderer=renderer
    )
    if not findings.accepted:
        raise InputError(f"certificate {path} does not hold: {findings.lines()[0]}; prove again")
    return Claim(
        path,
        certificate,
        flights=sum(findings.flights.values()),
        uniform=findings.flights.get(ANYWHERE, 0),
        seed=seed.value,
        seed_is_fixed=seed.is_fixed,
    )
