"""Runs benchmarks one after the other, and goes on where an earlier command stopped."""

import logging
import shutil
from collections.abc import Mapping, Sequence

from benchmarks.benchmark import Benchmark, Setup
from benchmarks.ledger import Ledger, digest_code, make_origin
from benchmarks.registry import BENCHMARKS
from drone_rl.utils.errors import InputError

_log = logging.getLogger(__name__)


def run_benchmarks(
    names: Sequence[str],
    setup: Setup,
    ledger: Ledger,
    *,
    again: bool,
    benchmarks: Mapping[str, Benchmark] = BENCHMARKS,
) -> dict[str, str]:
    """Measures, and notes each benchmark's figures as soon as they are known.

    One that can't be run stops no other.

    Args:
        names: Which, in this order.
        setup: Where and how thoroughly.
        ledger: Where figures are noted.
        again: Whether to measure what was measured before with just this code and setup.
        benchmarks: All that there are.

    Returns:
        Why those failed that did, by name.
    """
    shutil.rmtree(setup.runs, ignore_errors=True)
    failures = {}
    settings = _settings(setup)
    for name in names:
        code = digest_code(benchmarks[name].measures)
        if not again and ledger.is_current(name, code, settings):
            _log.info("benchmark %s: measured already with just this code; name it to repeat", name)
            continue
        _log.info("benchmark %s", name)
        try:
            ledger.add(name, benchmarks[name].run(setup), make_origin(code, settings))
        except (InputError, RuntimeError) as error:
            failures[name] = str(error)
            _log.error("benchmark %s: %s", name, error)
    return failures


def _settings(setup: Setup) -> dict[str, object]:
    """What two measurements must share for their figures to be the same kind."""
    return {
        "quick": setup.quick,
        "device": setup.device,
        "num_envs": setup.num_envs,
        "seeds": list(setup.seeds),
        "episodes": setup.episodes,
        "memory_frames": setup.memory_frames,
    }
