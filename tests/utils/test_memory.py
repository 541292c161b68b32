"""Freed memory returns to the operating system."""

import subprocess
import sys

import pytest

from drone_rl.utils.memory import return_freed_memory

PROGRAM = """
import os
from pathlib import Path
from drone_rl.utils.memory import return_freed_memory

def resident():
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE") / 2**20

blocks = [bytes(100_000) for _ in range(2000)]  # too small for the system's own pages
kept = blocks[::10]
del blocks
before = resident()
return_freed_memory()
print(before - resident(), len(kept))
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_gaps_between_blocks_in_use_are_returned():
    """In a process of its own, whose free memory no other test has shaped."""
    command = [sys.executable, "-c", PROGRAM]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert float(done.stdout.split()[0]) > 100  # MiB


def test_other_systems_have_no_such_function(monkeypatch):
    monkeypatch.setattr("ctypes.CDLL", lambda _: object())
    return_freed_memory()
