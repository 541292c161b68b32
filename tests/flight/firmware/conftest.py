"""The stub firmware, and where it can be kept."""

import sys
from pathlib import Path

import pytest

from drone_rl.flight.firmware.keeping import Keeping

STUB = Path(__file__).with_name("stub_firmware.py")


@pytest.fixture(scope="session")
def own_network():
    """Skips where a program can't have a network of its own: ports would be shared by tests."""
    with Keeping() as keeping:
        if keeping.shared:
            pytest.skip(f"no network namespaces here: {keeping.shared}")


@pytest.fixture
def stub(own_network):
    """How to start the stub firmware, with what is wrong with it."""
    return lambda how="": [sys.executable, "-I", str(STUB), how]
