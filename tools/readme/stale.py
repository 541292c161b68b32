"""Which figures are older than the code that they measure."""

from collections.abc import Iterable, Mapping
from pathlib import Path

from benchmarks.benchmark import Benchmark
from benchmarks.ledger import Ledger, digest_code


def tell_ages(benchmarks: Mapping[str, Benchmark], ledger: Ledger, root: Path) -> Iterable[str]:
    """A line for each benchmark: of today's code, older, never run, or of code that nobody noted.

    Args:
        benchmarks: All that there are.
        ledger: What was measured.
        root: Of the checkout.
    """
    for name, benchmark in benchmarks.items():
        origin = ledger.origins.get(name)
        if origin is None:
            yield f"{name}: never measured"
            continue
        since = f"measured {origin.date} at {(origin.revision or 'an unknown revision')[:12]}"
        if origin.code is None:
            yield f"{name}: {since}, of code that was not noted"
        elif origin.code == digest_code(benchmark.measures, root):
            yield f"{name}: {since}, of today's code"
        else:
            yield f"{name}: {since}, OLDER than what it measures ({', '.join(benchmark.measures)})"
