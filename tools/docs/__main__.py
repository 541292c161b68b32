"""`python -m tools.docs [--update | --time] [PAGE ...]`: see the package."""

import sys

from tools.docs.blocks import find_pages
from tools.docs.run import describe_failures, run_page
from tools.docs.session import NOT_RUN
from tools.docs.timing import describe, time_page
from tools.docs.update import update_page


def main(arguments: list[str]) -> int:
    """Run pages and return the exit status."""
    known, failed = find_pages(), False
    pages = [word for word in arguments if word not in ("--update", "--time")]
    if unknown := sorted({*pages} - {*known}):
        print(f"error: {', '.join(unknown)}: no such page; pages: {', '.join(known)}")
        return 2
    if "--time" in arguments:
        return max((_time(page) for page in pages or known), default=0)
    for page in pages or known:
        outcomes = run_page(page)
        if "--update" in arguments:
            print(*update_page(page, outcomes), sep="\n")
        failures = describe_failures({page: outcomes})
        skipped = sum(outcome.status == NOT_RUN for outcome in outcomes)
        seconds = sum(outcome.seconds for outcome in outcomes)
        print(
            f"{page}: {len(outcomes)} blocks, {skipped} not run, {len(failures)} failed, "
            f"{seconds:.0f} s"
        )
        print(*failures, sep="\n\n")
        failed |= bool(failures)
    return int(failed)


def _time(page: str) -> int:
    """Print the times of a page and its blocks; return the exit status."""
    timings = []
    for timing in time_page(page):
        print(timing, flush=True)
        timings.append(timing)
    if timings:
        print(describe(page, timings), flush=True)
    return int(not all(timing.is_expected for timing in timings))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
