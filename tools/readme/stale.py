"""Report the figures that are older than the code that they measure."""

from collections.abc import Iterable, Mapping
from pathlib import Path

from benchmarks.benchmark import Benchmark
from benchmarks.ledger import Ledger, digest_code


def report_ages(benchmarks: Mapping[str, Benchmark], ledger: Ledger, root: Path) -> Iterable[str]:
    """Return a line for each benchmark: current, outdated, never run, or of unknown code.

    Args:
        benchmarks: All benchmarks by name.
        ledger: The measurements.
        root: Root of the checkout.
    """
    for name, benchmark in benchmarks.items():
        origin = ledger.origins.get(name)
        if origin is None:
            yield f"{name}: never measured"
            continue
        since = f"measured {origin.date} at {(origin.revision or 'an unknown revision')[:12]}"
        if origin.code is None:
            yield f"{name}: {since}, of unknown code"
        elif origin.code == digest_code(benchmark.measures, root):
            yield f"{name}: {since}, current"
        else:
            yield f"{name}: {since}, OUTDATED: {', '.join(benchmark.measures)} changed since"
