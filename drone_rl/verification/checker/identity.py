"""Whether a certificate is of a policy: by the hash of its weights and by its description."""

import hashlib
from collections.abc import Mapping

import torch

from drone_rl.config import BaseTaskSettings
from drone_rl.policies.zoo import PolicyDescription
from drone_rl.utils.errors import InputError
from drone_rl.verification.checker.certificate import Certificate
from drone_rl.verification.requirements import require_moves


def fingerprint(weights: Mapping[str, torch.Tensor]) -> str:
    """The hash (SHA-256) of a network's weights, as certificates have it.

    Args:
        weights: A state dict; its order and device don't matter.
    """
    digest = hashlib.sha256()
    for name in sorted(weights):
        value = weights[name].detach().cpu().contiguous()
        digest.update(f"{name} {list(value.shape)}\n".encode())
        digest.update(value.numpy().astype("<f4").tobytes())
    return digest.hexdigest()


def refuse_another(
    certificate: Certificate,
    described: PolicyDescription,
    weights: Mapping[str, torch.Tensor],
    task: BaseTaskSettings | None = None,
) -> None:
    """Makes sure that a certificate is of this policy, and that it can be.

    Args:
        certificate: Which.
        described: The policy's description; its task doesn't count.
        weights: Of its network.
        task: That it must be stated of; any by default.

    Raises:
        InputError: It is of another network, camera or task, or the policy remembers pictures, or
            its camera goes wrong.
    """
    for of in (certificate.description, described):
        require_moves(of.dynamics, of.actions, "what a certificate states")
    if certificate.weights != (own := fingerprint(weights)):
        raise InputError(
            f"the certificate is of a network with the hash {certificate.weights[:12]}..., the "
            f"policy's has {own[:12]}...; give policy= the file that was proved"
        )
    stated, own_parts = certificate.description.as_dict(), described.as_dict()
    for part in ("appearance", "dynamics", "actions", "camera", "transforms", "network"):
        if stated.get(part) != own_parts.get(part):
            raise InputError(
                f"the certificate and the policy differ in {part}; give policy= the file that was "
                "proved"
            )
    if task is not None and certificate.task != task:
        name = next(n for n, v in task.values().items() if certificate.task.values()[n] != v)
        raise InputError(
            f"the certificate is of another task: {name}={getattr(certificate.task, name)}, not "
            f"{getattr(task, name)}; prove the policy in that task"
        )
    if any(choice.name == "stack" for choice in described.transforms):
        raise InputError(
            "the policy remembers pictures (transform stack); certificates are of policies that "
            "act by the present picture alone"
        )
    if described.faults:
        raise InputError(
            f"the policy's camera goes wrong (transform {described.faults[0]}); certificates are "
            "of pictures as they are drawn"
        )
