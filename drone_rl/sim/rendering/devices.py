"""Where pictures are drawn, and Warp, which does it, started without a word."""

import functools
from contextlib import AbstractContextManager, nullcontext

import torch
import warp as wp

from drone_rl.utils.errors import InputError
from drone_rl.utils.quiet import standard_error_closed


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


def on_torch_stream(device: torch.device) -> AbstractContextManager:
    """Puts Warp's launches in order with torch's on a GPU; a CPU has no streams."""
    if device.type == "cpu":
        return nullcontext()
    return wp.ScopedStream(wp.stream_from_torch(torch.cuda.current_stream(device)))
