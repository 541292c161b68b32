"""Where pictures are drawn, and Warp, which does it, started without a word."""

import functools
import os
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from types import ModuleType

import torch
import warp as wp

from drone_rl.utils.errors import InputError
from drone_rl.utils.imports import standard_error_closed
from drone_rl.utils.provenance import num_cores


def check_device(device: str) -> None:
    """Refuses a device that this machine lacks.

    Raises:
        InputError: It is neither "cpu" nor a CUDA device that is there.
    """
    kind = device.split(":")[0]
    if kind not in ("cpu", "cuda"):
        raise InputError(f"device={device} is unknown; give cpu, cuda or cuda:N")
    if kind == "cuda" and not (torch.cuda.is_available() and wp.get_cuda_device_count()):
        raise InputError(f"device={device}, but no CUDA GPU is usable here; give device=cpu")


@functools.cache
def start_warp(device: str) -> None:
    """Starts Warp, once; on a CPU it says nothing of the CUDA that is missing.

    Raises:
        InputError: There is no such device.
    """
    check_device(device)
    quiet = wp.LOG_ERROR if device == "cpu" else wp.LOG_WARNING
    wp.config.log_level = max(wp.config.log_level, quiet)
    with standard_error_closed() if device == "cpu" else nullcontext():
        wp.init()  # its native part tells, whatever the level


def loading(kernels: ModuleType) -> Future[None]:
    """Kernels for the CPU, compiled on a thread aside or taken from the cache, once a process.

    The first time a compiler works for seconds at each module, and at several at once on as many
    cores: so ask early, and wait for the result before the first launch.

    Args:
        kernels: The module that has them.
    """
    start_warp("cpu")
    with _ONE_AT_A_TIME:
        return _loading(kernels, os.getpid())


_ONE_AT_A_TIME = threading.Lock()
"""Asks: two threads that draw may both be the first."""


@functools.cache
def _loading(kernels: ModuleType, process: int) -> Future[None]:
    del process  # none of its threads goes on in a fork
    aside = ThreadPoolExecutor(1, "compile")
    loaded = aside.submit(_load, kernels)
    aside.shutdown(wait=False)
    return loaded


def _load(kernels: ModuleType) -> None:
    wp.load_module(kernels, device="cpu")


def on_torch_stream(device: torch.device) -> AbstractContextManager:
    """Puts Warp's launches in order with torch's on a GPU; a CPU has no streams."""
    if device.type == "cpu":
        return nullcontext()
    return wp.ScopedStream(wp.stream_from_torch(torch.cuda.current_stream(device)))


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
