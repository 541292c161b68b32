"""Compute devices, Warp's start-up and kernel loading, and a worker pool for CPU kernels."""

import functools
import os
import re
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import AbstractContextManager, nullcontext
from types import ModuleType

import torch
import warp as wp

from drone_rl.utils.errors import InputError
from drone_rl.utils.imports import standard_error_closed
from drone_rl.utils.provenance import num_cores

_LOADING = threading.Lock()
"""Two threads may both be the first to start Warp or to load kernels."""


def check_device(device: str) -> None:
    """Raise an `InputError` unless a device is "cpu" or an available CUDA device."""
    if not re.fullmatch("cpu|cuda(:[0-9]+)?", device):
        raise InputError(f"device={device} is unknown; give cpu, cuda or cuda:N")
    wp.config.log_level = max(wp.config.log_level, wp.LOG_WARNING)  # the count below starts Warp
    if device == "cpu":
        return
    count = torch.cuda.is_available() and wp.get_cuda_device_count()
    if not count:
        raise InputError(f"device={device}, but no CUDA GPU is usable here; give device=cpu")
    if int(device.partition(":")[2] or 0) >= count:
        raise InputError(
            f"device={device}, but the number of usable CUDA GPUs is {count}; give cuda:N with N "
            f"of at most {count - 1}"
        )


def start_warp(device: str) -> None:
    """Start Warp once, on a CPU without warnings about CUDA; for errors see `check_device`."""
    with _LOADING:
        _start_warp(device)


@functools.cache
def _start_warp(device: str) -> None:
    check_device(device)
    if device == "cpu":
        wp.config.log_level = max(wp.config.log_level, wp.LOG_ERROR)
    with standard_error_closed() if device == "cpu" else nullcontext():
        wp.init()  # its native part ignores the log level


def load_kernels(kernels: ModuleType | wp.Module) -> Future[None]:
    """Compile or load CPU kernels in a thread, in seconds; later calls return the same future."""
    start_warp("cpu")
    with _LOADING:
        return _load_kernels(kernels, os.getpid())


@functools.cache
def _load_kernels(kernels: ModuleType | wp.Module, process: int) -> Future[None]:
    del process  # a fork has none of its parent's threads
    compiler = ThreadPoolExecutor(1, "compile")
    loaded = compiler.submit(wp.load_module, kernels, device="cpu")
    compiler.shutdown(wait=False)
    return loaded


def on_torch_stream(device: torch.device) -> AbstractContextManager:
    """Order Warp's launches with torch's on a GPU; a CPU has no streams."""
    if device.type == "cpu":
        return nullcontext()
    return wp.ScopedStream(wp.stream_from_torch(torch.cuda.current_stream(device)))


class WorkerPool:
    """Threads that split a batch: a Warp CPU kernel runs on one core, without Python's lock."""

    def __init__(self, num_rows: int, size: int | None = None) -> None:
        """Start `size` threads, by default one per core, but no more than the expected rows."""
        self.size = max(1, min(size or num_cores(), num_rows))
        self._executor = None if self.size == 1 else ThreadPoolExecutor(self.size, "render")

    def map_spans(self, first: int, last: int, work: Callable[[int, int, int], None]) -> None:
        """Call `work(worker, begin, end)` for each worker's span of [first, last), and wait.

        An error of a worker is raised once all have ended.
        """
        length = -(-(last - first) // self.size)
        spans = [(i, min(i + length, last)) for i in range(first, last, max(length, 1))]
        if self._executor is None or len(spans) < 2:
            for worker, span in enumerate(spans):
                work(worker, *span)
            return
        others = [self._executor.submit(work, i, *span) for i, span in enumerate(spans[1:], 1)]
        try:
            work(0, *spans[0])
        finally:
            wait(others)
        for other in others:
            other.result()

    def close(self) -> None:
        """Stop the threads."""
        if self._executor is not None:
            self._executor.shutdown()
