"""Run benchmarks in sequence; skip those whose figures are current."""

import logging
import os
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
    """Run benchmarks and store the figures of each as soon as it ends.

    A benchmark that fails does not stop the others.

    Args:
        names: The benchmarks to run, in this order.
        setup: Device, sizes and folder of the measurement.
        ledger: Results file to write.
        again: Whether to repeat benchmarks whose figures are current.
        benchmarks: All known benchmarks by name.

    Returns:
        The error message of each benchmark that failed, by name.
    """
    shutil.rmtree(setup.runs, ignore_errors=True)
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # a user's second command has compiled files
    failures = {}
    settings = _settings(setup)
    for name in names:
        code = digest_code(benchmarks[name].measures)
        if not again and ledger.is_current(name, code, settings):
            _log.info("benchmark %s: figures are current; name the benchmark to repeat it", name)
            continue
        _log.info("benchmark %s", name)
        try:
            ledger.add(name, benchmarks[name].run(setup), make_origin(code, settings))
        except (InputError, RuntimeError) as error:
            failures[name] = str(error)
            _log.error("benchmark %s: %s", name, error)
    return failures


def _settings(setup: Setup) -> dict[str, object]:
    """Return the settings that two measurements must share to be comparable."""
    return {
        "quick": setup.quick,
        "device": setup.device,
        "num_envs": setup.num_envs,
        "seeds": list(setup.seeds),
        "episodes": setup.episodes,
        "memory_frames": setup.memory_frames,
    }
