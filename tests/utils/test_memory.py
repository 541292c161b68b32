"""What was freed goes back to the system, and oneDNN's kernels are bounded before there is one."""

import os
import sys
from pathlib import Path

import pytest

from drone_rl.utils import memory
from drone_rl.utils.memory import bound_kernels, return_freed_memory
from tests.forked import run_forked

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
    memory._trim.cache_clear()
    return_freed_memory()
    memory._trim.cache_clear()


def test_bounding_kernels_leaves_the_environment_as_it_was(monkeypatch):
    name = "ONEDNN_PRIMITIVE_CACHE_CAPACITY"
    monkeypatch.setenv(name, "7")
    bound_kernels()
    assert os.environ[name] == "7"
    monkeypatch.delenv(name)
    bound_kernels()
    assert name not in os.environ


def test_kernels_of_many_shapes_take_bounded_memory(tmp_path):
    """A convolution of 300 shapes: with 4 kernels kept it must hold far less than with all."""
    code = """
import os, sys, torch
from drone_rl.utils import memory
os.environ.pop("ONEDNN_PRIMITIVE_CACHE_CAPACITY", None)
memory.KEPT_KERNELS = int(sys.argv[1])
memory.bound_kernels()
torch.set_num_threads(1)
layer = torch.nn.Conv2d(16, 32, 3).to(memory_format=torch.channels_last)
def resident():
    memory.return_freed_memory()
    return int(open("/proc/self/statm").read().split()[1]) * os.sysconf("SC_PAGESIZE") / 2**20
with torch.no_grad():
    for n in range(280, 301):
        layer(torch.zeros(n, 16, 6, 6))
    before = resident()
    for n in range(1, 280):
        layer(torch.zeros(n, 16, 6, 6))
print(resident() - before)
"""
    grown = [float(run_forked(code, kept, cwd=tmp_path).stdout) for kept in (4, 1000)]
    assert grown[0] + 4 < grown[1]
