"""State of the calling thread, where libraries offer only that of the whole process."""

import contextlib
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextvars import ContextVar
from typing import TypeVar

import torch

T = TypeVar("T")
_SETTING = threading.Lock()


def set_torch_threads(count: int) -> None:
    """Set the number of PyTorch's threads for the calling thread only.

    `torch.set_num_threads` also sets that of threads which have not used PyTorch yet.
    """
    with _SETTING, ThreadPoolExecutor(1) as other:
        of_new_threads = other.submit(torch.get_num_threads).result()
        torch.get_num_threads()  # its first call in a thread takes over that of new threads
        torch.set_num_threads(count)
        other.submit(torch.set_num_threads, of_new_threads).result()


@contextlib.contextmanager
def torch_threads(count: int) -> Iterator[None]:
    """Run the block with `count` threads of PyTorch; other threads keep theirs."""
    before = torch.get_num_threads()
    set_torch_threads(count)
    try:
        yield
    finally:
        set_torch_threads(before)


def pool_like_caller(size: int) -> ThreadPoolExecutor:
    """Return threads, each with as many threads of PyTorch as the calling thread has."""
    num_threads = torch.get_num_threads()
    return ThreadPoolExecutor(size, initializer=set_torch_threads, initargs=(num_threads,))


@contextlib.contextmanager
def set_in_thread(variable: ContextVar[T], value: T) -> Iterator[None]:
    """Set a variable for the block, in the calling thread only."""
    token = variable.set(value)
    try:
        yield
    finally:
        variable.reset(token)
