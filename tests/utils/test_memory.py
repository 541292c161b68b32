"""Freed memory returns to the operating system."""

import os
import sys
from pathlib import Path

import pytest

from drone_rl.utils.memory import return_freed_memory

MIB = 2**20


def resident():
    """MiB of this process."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE") / MIB


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_gaps_between_blocks_in_use_are_returned():
    blocks = [bytes(100_000) for _ in range(2000)]  # too small for the system's own pages
    kept = blocks[::10]
    del blocks
    before = resident()
    return_freed_memory()
    assert len(kept) == 200
    assert before - resident() > 100


def test_other_systems_have_no_such_function(monkeypatch):
    monkeypatch.setattr("ctypes.CDLL", lambda _: object())
    return_freed_memory()
