"""Compare the memory that settings need with what is available, before it is allocated."""

import re
from collections.abc import Iterator
from pathlib import Path

from drone_rl.utils.errors import InputError

_GIB = 2**30
_CONTAINER = Path("/sys/fs/cgroup")
"""Limit and usage of a container's memory (cgroup version 2)."""
_CACHE = re.compile(r"^(?:in)?active_file (\d+)$", re.MULTILINE)
"""Entries of memory.stat: files that the system drops when memory is needed."""
RANDOM_STATE_BYTES = 2_000
"""Least memory of an environment's random stream and state."""
EPISODE_BYTES = 50
"""Least memory of the outcome of an episode."""


def environment_bytes(pixels: int, renderer: str) -> int:
    """Return the least memory of an environment in bytes, without the episodes of a batch.

    The CPU ray tracer was measured at 66 bytes a pixel, scratch memory included.
    """
    return RANDOM_STATE_BYTES + pixels * (50 if renderer == "raytrace" else 6)


def require_memory(needed: int, setting: str, remedy: str) -> None:
    """Raise an `InputError` if a setting needs more bytes than are available."""
    available = available_bytes()
    if available is not None and needed > available:
        raise InputError(
            f"{setting} needs at least {needed / _GIB:,.1f} GiB of memory, but "
            f"{available / _GIB:,.1f} GiB are available; {remedy}"
        )


def available_bytes() -> int | None:
    """Return the memory that this process may still allocate; None if the system does not say.

    It is the least that the system and the container allow.
    """
    return min(_available(), default=None)


def _available() -> Iterator[int]:
    for line in _read(Path("/proc/meminfo")).splitlines():
        if line.startswith("MemAvailable:"):
            yield int(line.split()[1]) * 1024
    limit, taken = (_read(_CONTAINER / f"memory.{name}").strip() for name in ("max", "current"))
    if limit.isdigit() and taken.isdigit():
        cache = sum(map(int, _CACHE.findall(_read(_CONTAINER / "memory.stat"))))
        yield max(0, int(limit) - max(0, int(taken) - cache))


def _read(path: Path) -> str:
    try:
        return path.read_text()
    except OSError:
        return ""
