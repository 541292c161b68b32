"""Compare the memory that settings need with what is available, before it is allocated."""

import re
from collections.abc import Iterator
from pathlib import Path

from drone_rl.utils.errors import InputError

_GIB = 2**30
_CGROUP = Path("/sys/fs/cgroup")
_LIMITS = (  # of a container: version 2, version 1
    (_CGROUP / "memory.max", _CGROUP / "memory.current"),
    (_CGROUP / "memory/memory.limit_in_bytes", _CGROUP / "memory/memory.usage_in_bytes"),
)
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

    It is the least that the system, the container and `ulimit -v` allow.
    """
    return min(_available(), default=None)


def _available() -> Iterator[int]:
    for line in _read(Path("/proc/meminfo")).splitlines():
        if line.startswith("MemAvailable:"):
            yield int(line.split()[1]) * 1024
    for most, used in _LIMITS:
        limit, taken = _read(most).strip(), _read(used).strip()
        if limit.isdigit() and taken.isdigit():
            cache = sum(map(int, _CACHE.findall(_read(most.with_name("memory.stat")))))
            yield max(0, int(limit) - max(0, int(taken) - cache))
    try:
        import resource  # not on Windows
    except ImportError:
        return
    limit, size = resource.getrlimit(resource.RLIMIT_AS)[0], _read(Path("/proc/self/statm"))
    if limit != resource.RLIM_INFINITY and size:
        yield max(0, limit - int(size.split()[0]) * resource.getpagesize())


def _read(path: Path) -> str:
    try:
        return path.read_text()
    except OSError:
        return ""
