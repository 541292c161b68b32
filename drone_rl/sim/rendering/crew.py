"""Threads that share the drawing of a batch: Warp runs a CPU kernel on one core."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from drone_rl.utils.provenance import num_cores


class Crew:
    """Shares rows of a batch out among threads; Warp's kernels let go of the interpreter's lock."""

    def __init__(self, num_rows: int, size: int | None = None) -> None:
        """Starts the threads.

        Args:
            num_rows: About how many rows there will be; no more threads than that.
            size: How many threads; the number of cores by default.
        """
        self.size = max(1, min(size or num_cores(), num_rows))
        self._pool = None if self.size == 1 else ThreadPoolExecutor(self.size, "render")

    def share_out(self, first: int, last: int, work: Callable[[int, int, int], None]) -> None:
        """Calls `work(member, first, last)` for each member's share of rows, and waits.

        Args:
            first: The first row.
            last: The one after the last.
            work: What each member does with its rows.
        """
        share = -(-(last - first) // self.size)
        spans = [(i, min(i + share, last)) for i in range(first, last, max(share, 1))]
        if self._pool is None or len(spans) < 2:
            for member, span in enumerate(spans):
                work(member, *span)
            return
        others = [self._pool.submit(work, i, *span) for i, span in enumerate(spans[1:], 1)]
        work(0, *spans[0])
        for other in others:
            other.result()

    def close(self) -> None:
        """Ends the threads."""
        if self._pool is not None:
            self._pool.shutdown()
