"""The independent checker of certificates: slow, plain, and without any code of the prover."""

from drone_rl.verification.checker.certificate import (
    Certificate,
    Outcome,
    check_same_policy,
    fingerprint,
    read_certificate,
)
from drone_rl.verification.checker.checker import (
    Contradiction,
    Findings,
    check_certificate,
    read_validated,
)
from drone_rl.verification.checker.sampling import find

__all__ = [
    "Certificate",
    "Contradiction",
    "Findings",
    "Outcome",
    "check_certificate",
    "check_same_policy",
    "find",
    "fingerprint",
    "read_certificate",
    "read_validated",
]
