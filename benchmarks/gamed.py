"""Adversarial policies; none of them may be judged good and certain, or proved."""

import logging
from collections.abc import Iterator
from pathlib import Path

from benchmarks import gamed_certificates, gamed_memory, gamed_rounding
from benchmarks.benchmark import Setup
from benchmarks.gamed_case import GamedCase

_MODULES = (gamed_memory, gamed_rounding, gamed_certificates)

_log = logging.getLogger(__name__)


def bench_gamed(setup: Setup) -> dict[str, int]:
    """Judge every adversarial policy with default settings.

    Returns:
        "gamed_verdicts": number of policies that are judged good or proved; "gamed_total": number
        of policies.
    """
    folder = setup.runs / "gamed"
    found = [(case.name, case.is_judged_good()) for case in all_cases(folder)]
    for name, is_deceived in found:
        if is_deceived:
            _log.warning("%s: judged good", name)
    deceived = sum(is_deceived for _, is_deceived in found)
    return {"gamed_verdicts": deceived, "gamed_total": len(found)}


def all_cases(folder: Path) -> Iterator[GamedCase]:
    """Yield the cases of all modules.

    Args:
        folder: Each module writes into its own subfolder.
    """
    for module in _MODULES:
        yield from module.cases(folder / module.__name__.rpartition(".")[2])
