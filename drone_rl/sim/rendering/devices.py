"""Compute devices, Warp's start-up and kernel loading, and a worker pool for CPU kernels."""

import atexit
import contextlib
import functools
import logging
import os
import re
import shutil
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import AbstractContextManager, nullcontext, suppress
from types import ModuleType
from typing import Any

import torch
import warp as wp

from drone_rl.utils.errors import InputError
from drone_rl.utils.provenance import num_cores

_log = logging.getLogger(__name__)
_LOADING = threading.Lock()
"""Two threads may both be the first to start Warp or to load kernels."""


@contextlib.contextmanager
def _standard_error_closed() -> Iterator[None]:
    """Discard all output to standard error, also of compiled code."""
    sys.stderr.flush()
    kept = os.dup(2)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        yield
    finally:
        sys.stderr.flush()  # an unfinished line, too
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


def check_defaults() -> None:
    """Raise an `InputError` if torch's default dtype or device has been changed."""
    if (dtype := torch.get_default_dtype()) != torch.float32:
        raise InputError(
            f"torch's default dtype is {dtype}; call torch.set_default_dtype(torch.float32)"
        )
    if (default := torch.get_default_device()).type != "cpu":
        raise InputError(
            f"torch's default device is {default}; call torch.set_default_device('cpu'), and give "
            "device=cuda for a GPU"
        )


def check_device(device: str) -> None:
    """Raise an `InputError` unless a device is "cpu" or an available CUDA device.

    See also `check_defaults`.
    """
    check_defaults()
    if not re.fullmatch("cpu|cuda(:[0-9]+)?", device):
        raise InputError(f"device={device} is unknown; give cpu, cuda or cuda:N")
    wp.config.log_level = max(wp.config.log_level, wp.LOG_WARNING)  # the count below starts Warp
    if device == "cpu":
        return
    _initialize_warp(is_quiet=False)
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
    _initialize_warp(is_quiet=device == "cpu")


def _initialize_warp(*, is_quiet: bool) -> None:
    """Start Warp; compile into a temporary folder if the one for kernels can't be written."""
    with _standard_error_closed() if is_quiet else nullcontext():  # Warp ignores the log level
        with suppress(OSError):
            wp.init()
            if os.access(str(wp.config.kernel_cache_dir), os.W_OK):
                return
        unwritable = wp.config.kernel_cache_dir
        wp.config.kernel_cache_dir = folder = tempfile.mkdtemp(prefix="warp-")
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        wp.init()
    _log.warning(
        "%s can't be written, so kernels are compiled again in each process, into %s; set the "
        "environment variable WARP_CACHE_PATH to a folder that can be written",
        unwritable,
        folder,
    )


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
        """Use `size` threads, by default one per core, but no more than the expected rows."""
        self.size = max(1, min(size or num_cores(), num_rows))
        self._executor: ThreadPoolExecutor | None = None

    def __getstate__(self) -> dict[str, Any]:
        """Return the state of a copy, which starts threads of its own."""
        return {**vars(self), "_executor": None}

    def map_spans(self, first: int, last: int, work: Callable[[int, int, int], None]) -> None:
        """Call `work(worker, begin, end)` for each worker's span of [first, last), and wait.

        The first call starts the threads, also after `close`. An error of a worker is raised once
        all have ended.
        """
        length = -(-(last - first) // self.size)
        spans = [(i, min(i + length, last)) for i in range(first, last, max(length, 1))]
        if self.size == 1 or len(spans) < 2:
            for worker, span in enumerate(spans):
                work(worker, *span)
            return
        if self._executor is None:
            self._executor = ThreadPoolExecutor(self.size, "render")
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
            self._executor = None
