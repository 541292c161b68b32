"""Find the certificate of a policy, check it by episodes, and prove again what it states."""

from pathlib import Path

from drone_rl.config.commands import CheckSettings, JudgeSettings
from drone_rl.policies.policy import BasePolicy, Policy
from drone_rl.policies.zoo import certificate_path
from drone_rl.trust.results import Proof
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import Progress, silent
from drone_rl.utils.seeding import RootSeed, root_seed
from drone_rl.utils.text import percent
from drone_rl.verification.checker.certificate import certificate_file
from drone_rl.verification.checker.checker import check_certificate, read_validated
from drone_rl.verification.prove import prove


def find_claim(
    policy: BasePolicy,
    certificate: str | Path | None = None,
    *,
    flights: int = JudgeSettings().certificate_flights,
    prove_again: bool = False,
    seed: RootSeed | None = None,
    device: str = "cpu",
    renderer: str = "raytrace",
    progress: Progress = silent,
) -> Proof | None:
    """Find and check the certificate of a policy in its task; return None if there is none.

    Args:
        policy: The policy.
        certificate: The file or its folder; by default the file next to the policy, see
            `drone_rl.policies.zoo.certificate_path`, which is returned as refused if it is invalid.
        flights: Episodes that check it, see `check_certificate`.
        prove_again: Whether to compute the proof here if the certificate states success from every
            placement and the episodes do not refute it.
        seed: Root of the placements' random streams, by default a fresh one.
        device: Device of the episodes.
        renderer: Renderer of the episodes and of the proof.
        progress: Called with the progress of the proof.

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
    path = certificate_path(policy.path) if certificate is None else certificate_file(certificate)
    if certificate is None and not path.is_file():
        return None
    seed = seed or root_seed(None)
    how = CheckSettings(device=device, renderer=renderer)
    try:
        claim = _read_and_check(policy, path, flights, seed, how)
        return _proved(claim, policy, how, progress) if prove_again and claim.every else claim
    except InputError as error:
        if certificate is not None:
            raise
        return Proof(path=str(path), refused=str(error))


def _read_and_check(
    policy: Policy, path: Path, flights: int, seed: RootSeed, how: CheckSettings
) -> Proof:
    weights = policy.state.weights
    stated = read_validated(path, policy.description, weights)
    claim = Proof(
        path=str(path),
        every=stated.is_full_success,
        share=stated.success,
        undecided=stated.undecided.share,
    )
    if not flights:
        return claim
    found = check_certificate(
        stated,
        weights,
        flights=flights,
        seed=seed.value,
        device=how.device,
        renderer=how.renderer,
    )
    if not found.accepted:
        raise InputError(f"certificate {path} does not hold: {found.lines()[0]}; prove again")
    return claim.replace(
        checked=sum(found.flights.values()),
        wrong_at_most=found.wrong_at_most,
        **seed.as_dict(),
    )


def _proved(claim: Proof, policy: Policy, how: CheckSettings, progress: Progress) -> Proof:
    """Return a claim of success from every placement as proved, or raise an InputError."""
    found = prove(policy, renderer=how.renderer, progress=progress)
    if found.is_proved:
        return claim.replace(computed=True)
    raise InputError(
        f"certificate {claim.path} does not hold: it states success from every placement, and a "
        f"proof finds {percent(found.success)} of them; prove again"
    )
