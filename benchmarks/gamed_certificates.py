"""Forged certificates and trivial tasks."""

import functools
import itertools
import json
import shutil
from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

from drone_rl.policies.policy import Policy, load_policy
from drone_rl.policies.zoo import certificate_path, fingerprint
from drone_rl.trust.judge import judge
from drone_rl.utils.progress import silent
from drone_rl.verification.checker.checker import Simulator
from drone_rl.verification.claim import find_claim

_TRIVIAL = {"lateral_bound": 0.5}
_EPISODES = 300
Forge = Callable[[Policy], dict[str, Any]]
"""Return the content of a forged certificate of a policy."""


def cases(folder: Path) -> dict[str, Callable[[], bool]]:
    """Return for each case whether it is judged good; each writes its files when it runs.

    Args:
        folder: Each case writes policy and forged file into its own subfolder.
    """

    def proved(case: str, name: str, forge: Forge, **options: Any) -> Callable[[], bool]:
        return functools.partial(_is_proved, folder / case, name, forge, **options)

    def plausible(policy: Policy) -> dict[str, Any]:
        return one_box(policy, steps_of(policy))

    one_sided = "right_and_forward"
    return {
        "a certificate of one box without steps": proved(
            "empty", one_sided, lambda policy: one_box(policy, {})
        ),
        "a certificate of one box with plausible steps": proved("box", one_sided, plausible),
        "the certificate of another policy under this name": proved("name", one_sided, _renamed),
        "the certificate of another policy with this hash": proved("hash", one_sided, _rehashed),
        "a certificate of a policy that fails in corners only": proved("rare", "good", plausible),
        "a certificate that nobody re-checks": proved(
            "unchecked", one_sided, plausible, certificate_flights=0
        ),
        "a certificate that one rollout re-checks": proved(
            "few", one_sided, plausible, certificate_flights=1
        ),
        "flying straight in a trivial task": lambda: _is_good("forward"),
        "a good policy in a trivial task": lambda: _is_good("good"),
    }


def one_box(policy: Policy, steps: dict[str, float]) -> dict[str, Any]:
    """Return a certificate that states full success from every placement of the cubes.

    Args:
        policy: The policy that the certificate names.
        steps: Fractions of the placements by number of steps.
    """
    task: Any = policy.task
    bound, cubes = task.lateral_bound, task.num_cubes
    won = {"end": "all_cubes", "collected": [True] * cubes, "loops": False, "share": 1.0}
    return certificate_of(policy, [{**won, "steps": steps, "boxes": [[[-bound, bound]] * cubes]}])


def many_boxes(policy: Policy, count: int = 24, episodes: int = 4000) -> dict[str, Any]:
    """Return a certificate of success from everywhere in so many boxes that few can be tested.

    Args:
        policy: The policy that the certificate names; it may fail from a few placements.
        count: Number of boxes along each cube's positions.
        episodes: Number of episodes that estimate the numbers of steps.
    """
    stated = one_box(policy, steps_of(policy, episodes=episodes))
    (outcome,) = stated["outcomes"]
    ((low, high), *_) = outcome["boxes"][0]
    ends = np.linspace(low, high, count + 1).tolist()
    pieces = itertools.product(itertools.pairwise(ends), repeat=len(outcome["collected"]))
    outcome["boxes"] = [[*map(list, box)] for box in pieces]
    return stated


def accepted_many_boxes(folder: Path, seeds: int = 20) -> int:
    """Return for how many seeds a forged certificate of many boxes passes as proved."""
    policy = _copy_shipped("good", folder)  # fails from 0.09% of all placements
    certificate_path(policy.path).write_text(json.dumps(many_boxes(policy)))
    return sum(_counts_as_proved(policy, seed=seed) for seed in range(seeds))


def certificate_of(
    policy: Policy,
    outcomes: list[dict[str, Any]],
    undecided: Sequence[Any] = (),
    share_undecided: float = 0.0,
    finished: bool = True,
) -> dict[str, Any]:
    """Return the content of a certificate with any statements.

    Args:
        policy: The policy that it names.
        outcomes: See `drone_rl.verification.checker.Outcome`.
        undecided: Undecided boxes.
        share_undecided: Fraction of the placements in undecided boxes.
        finished: Whether the certificate states that the proof is complete.
    """
    return {
        "format": "drone_rl certificate",
        "format_version": 1,
        "policy": {
            "name": policy.name,
            "weights": fingerprint(policy.state.weights),
            "description": policy.description.model_dump(mode="json"),
        },
        "outcomes": outcomes,
        "undecided": {"share": share_undecided, "boxes": list(undecided)},
        "finished": finished,
        "stated": {"logit_gap": 1e-4, "largest_band": 1e-5, "renderer": "Raytracer"},
        "found": {"least_gap": 0.0, "pictures": 1, "states": 1, "most_boxes": 1, "seconds": 1.0},
    }


def steps_of(
    policy: Policy, total: float = 0.98, high: float | None = None, episodes: int = _EPISODES
) -> dict[str, float]:
    """Estimate the fraction of placements by number of steps from random placements.

    An attacker can do the same, so these numbers of steps are plausible.

    Args:
        policy: The policy, in its task.
        total: Sum of the returned fractions.
        high: Largest y of the first cube, metres; the task's bound by default.
        episodes: Number of random placements.
    """
    task: Any = policy.task
    bound, cubes, rng = task.lateral_bound, task.num_cubes, np.random.default_rng(7)
    places = rng.uniform(-bound, bound, (episodes, cubes))
    places[:, 0] = rng.uniform(-bound, bound if high is None else high, episodes)
    with closing(Simulator(policy.description, policy.state.weights)) as simulator:
        steps = simulator.fly(places).steps
    numbers, counts = np.unique(steps, return_counts=True)
    pairs = zip(numbers.tolist(), counts.tolist(), strict=True)
    return {str(number): total * count / episodes for number, count in pairs}


def _copy_shipped(name: str, folder: Path) -> Policy:
    """Copy a shipped policy to a folder and load the copy."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "policy.safetensors"
    shutil.copy(load_policy(name).path, path)
    return load_policy(path)


def _honest_certificate() -> dict[str, Any]:
    return json.loads(certificate_path(load_policy("proved").path).read_text())


def _renamed(policy: Policy) -> dict[str, Any]:
    data = _honest_certificate()
    data["policy"]["name"] = policy.name
    return data


def _rehashed(policy: Policy) -> dict[str, Any]:
    data = _honest_certificate()
    data["policy"] = one_box(policy, {})["policy"]
    return data


def _is_proved(folder: Path, name: str, forge: Forge, **options: Any) -> bool:
    policy = _copy_shipped(name, folder)
    certificate_path(policy.path).write_text(json.dumps(forge(policy)))
    return _counts_as_proved(policy, **options)


def _counts_as_proved(policy: Policy, **options: Any) -> bool:
    how = {"episodes": 20, "sampled": False, "require": "proved", "progress": silent}
    judged = judge(policy, **how, find_claim=find_claim, **options)
    return judged.is_proved or judged.status("proved") == 0


def _is_good(name: str) -> bool:
    judged = judge(name, task=_TRIVIAL, progress=silent)
    return judged.status("good") == 0 or judged.status() == 0
