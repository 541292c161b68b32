"""`drone-rl bench truth`, adversarial policies: none may be called good and certain, or proved."""

import logging
from collections.abc import Iterator
from pathlib import Path

from benchmarks import gamed_certificates, gamed_memory, gamed_rounding
from benchmarks.gamed_case import GamedCase

_MODULES = (gamed_memory, gamed_rounding, gamed_certificates)

_log = logging.getLogger(__name__)


def bench_gamed(folder: Path) -> dict[str, int]:
    """Judge every adversarial policy as a user would, with default settings.

    Args:
        folder: For the policies' files; made if need be.

    Returns:
        "gamed_verdicts": how many deceived the program; "gamed_total": how many tried.
    """
    found = [(case.name, case.called_good()) for case in all_cases(folder)]
    for name, is_deceived in found:
        if is_deceived:
            _log.warning("%s: called good", name)
    deceived = sum(is_deceived for _, is_deceived in found)
    return {"gamed_verdicts": deceived, "gamed_total": len(found)}


def all_cases(folder: Path) -> Iterator[GamedCase]:
    """The cases of all modules.

    Args:
        folder: Each module gets a folder of its own below it.
    """
    for module in _MODULES:
        yield from module.cases(folder / module.__name__.rpartition(".")[2])
