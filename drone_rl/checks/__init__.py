"""The second checker of certificates: slow, plain, and with nothing of the prover in it."""

from drone_rl.checks.certificate import Certificate, Outcome, read_certificate
from drone_rl.checks.checker import Contradiction, Findings, check_certificate
from drone_rl.checks.identity import fingerprint, refuse_another

__all__ = [
    "Certificate",
    "Contradiction",
    "Findings",
    "Outcome",
    "check_certificate",
    "fingerprint",
    "read_certificate",
    "refuse_another",
]
