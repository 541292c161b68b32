"""Adversarial policies; none of them may be judged good and certain, or proved."""

import logging

from benchmarks import gamed_certificates, gamed_memory, gamed_rounding
from benchmarks.benchmark import Setup

_log = logging.getLogger(__name__)


def bench_gamed(setup: Setup) -> dict[str, int]:
    """Judge every adversarial policy with default settings.

    Returns:
        "gamed_verdicts": number of policies that are judged good or proved; "gamed_total": number
        of policies. "forged_boxes_proved": for how many of "forged_boxes_seeds" seeds a certificate
        of 13,824 boxes, which is wrong about few placements, counts as proved.
    """
    folder = setup.runs / "gamed"
    cases = {
        **gamed_memory.cases(folder / "memory"),
        **gamed_rounding.cases(folder / "rounding"),
        **gamed_certificates.cases(folder / "certificates"),
    }
    deceived = [name for name, is_judged_good in cases.items() if is_judged_good()]
    for name in deceived:
        _log.warning("%s: judged good", name)
    seeds = 2 if setup.quick else 20
    return {
        "gamed_verdicts": len(deceived),
        "gamed_total": len(cases),
        "forged_boxes_proved": gamed_certificates.accepted_many_boxes(folder / "boxes", seeds),
        "forged_boxes_seeds": seeds,
    }
