"""The stub firmware, and where it can be kept."""

import sys
from pathlib import Path

import pytest

from drone_rl.flight.betaflight.process import FirmwareProcess

STUB = Path(__file__).with_name("stub_firmware.py")


@pytest.fixture(scope="session")
def own_network(tmp_path_factory):
    """Skips where a program can't have a network of its own: ports would be shared by tests."""
    folder = tmp_path_factory.mktemp("network")
    with FirmwareProcess() as process:
        process.start(["/bin/true"], folder, folder / "log")
        if process.shared:
            pytest.skip(f"no network namespaces here: {process.shared}")


@pytest.fixture
def stub(own_network):
    """How to start the stub firmware, with what is wrong with it."""
    return lambda how="": [sys.executable, "-I", str(STUB), how]
