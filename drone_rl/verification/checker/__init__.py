"""The second checker of certificates: slow, plain, and with nothing of the prover in it."""

from drone_rl.verification.checker.certificate import Certificate, Outcome, read_certificate
from drone_rl.verification.checker.checker import Contradiction, Findings, check_certificate
from drone_rl.verification.checker.identity import fingerprint, refuse_another
from drone_rl.verification.checker.places import find
from drone_rl.verification.checker.trying import read_tried

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
