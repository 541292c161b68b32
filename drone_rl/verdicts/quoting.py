"""Which certificate a verdict, a card or a report may quote of a policy."""

from pathlib import Path
from typing import Any

from drone_rl.config.commands import JudgeSettings
from drone_rl.policies.base_policy import Pilot
from drone_rl.policies.policy import Policy
from drone_rl.policies.zoo import certificate_path
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import RootSeed, root_seed
from drone_rl.verdicts.proof import Claim
from drone_rl.verification.checker import check_certificate, read_tried
from drone_rl.verification.checker.drawing import ANYWHERE


def find_claim(
    policy: Pilot,
    given: str | Path | None = None,
    *,
    flights: int = JudgeSettings.certificate_flights,
    seed: RootSeed | None = None,
    device: str = "cpu",
    renderer: str = "raytrace",
) -> Claim | None:
    """Find and check the certificate of a policy; see `drone_rl.verification.checker.read_tried`.

    Args:
        policy: Which, in the task that counts.
        given: The certificate's file, or a folder that holds a certificate.json; by default the one
            that lies with the policy, see `drone_rl.policies.zoo.certificate_path`.
        flights: Rollouts that re-check it from other placements; 0 for none.
        seed: Root of the random stream of these placements; a fresh one by default.
        device: Where they are flown.
        renderer: Who draws, see `drone_rl.sim.rendering.find_renderer`.

    Returns:
        None if none is given and none lies there, as for a policy in no file. One that lies there
        and can't be believed is returned as refused.

    Raises:
        InputError: The one that is given can't be read, is of another network or task, contradicts
            itself, or is refuted by a flight.
    """
    if not isinstance(policy, Policy):
        if given is not None:
            raise InputError(
                f"certificate={given}, but policy={policy.name} was made elsewhere, and nothing is "
                "proved of it; leave the certificate out"
            )
        return None
    path = certificate_path(policy.path) if given is None else _file(Path(given))
    if given is None and not path.is_file():
        return None
    try:
        return _try(policy, path, flights, seed=seed, device=device, renderer=renderer)
    except InputError as error:
        if given is not None:
            raise
        return Claim(path, None, refused=str(error))


def _file(path: Path) -> Path:
    return path / "certificate.json" if path.is_dir() else path


def _try(
    policy: Policy, path: Path, flights: int, *, seed: RootSeed | None, **flying: Any
) -> Claim:
    weights = policy.state["policy"]
    certificate = read_tried(path, policy.description, weights)
    if not flights:
        return Claim(path, certificate)
    seed = seed or root_seed(None)
    found = check_certificate(certificate, weights, flights=flights, seed=seed.value, **flying)
    if not found.accepted:
        raise InputError(f"certificate {path} does not hold: {found.lines()[0]}; prove again")
    return Claim(
        path,
        certificate,
        flights=sum(found.flights.values()),
        uniform=found.flights.get(ANYWHERE, 0),
        seed=seed.value,
        seed_is_fixed=seed.is_fixed,
    )
