"""What must hold before anybody quotes a certificate, short of flights: exact sums, and whose."""

from collections.abc import Mapping
from pathlib import Path

import torch

from drone_rl.policies.zoo import PolicyDescription
from drone_rl.utils.errors import InputError
from drone_rl.verification.checker.certificate import Certificate, read_certificate
from drone_rl.verification.checker.claims import find_lies
from drone_rl.verification.checker.identity import refuse_another


def read_tried(
    path: Path, described: PolicyDescription, weights: Mapping[str, torch.Tensor]
) -> Certificate:
    """A certificate of this very policy and task, whose boxes and shares go together exactly.

    That flights end as it states is not looked at, see `check_certificate`.

    Args:
        path: Of the file.
        described: The policy's description, in the task that counts.
        weights: Of its network.

    Raises:
        InputError: It can't be read, is of another network, camera or task, or contradicts itself.
    """
    certificate = read_certificate(path)
    refuse_another(certificate, described, weights, described.task)
    lie = next(find_lies(certificate), None)
    if lie is not None:
        raise InputError(f"certificate {path} contradicts itself: {lie}; prove the policy again")
    return certificate
