"""The second checker of certificates: slow, plain, and with nothing of the prover in it."""

from drone_rl.verification.checker.certificate import (
    Certificate,
    Outcome,
    fingerprint,
    read_certificate,
    refuse_another,
)
from drone_rl.verification.checker.checker import (
    Contradiction,
    Findings,
    check_certificate,
    read_tried,
)
from drone_rl.verification.checker.sampling import find

__all__ = [
    "Certificate",
    "Contradiction",
    "Findings",
    "Outcome",
    "check_certificate",
    "find",
    "fingerprint",
    "read_certificate",
    "read_tried",
    "refuse_another",
]
