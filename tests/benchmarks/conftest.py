import pytest

from benchmarks.benchmark import Setup
from drone_rl.config.commands import BenchSettings


@pytest.fixture
def setup(tmp_path):
    """Return the setup of `drone-rl bench --quick`."""
    return Setup.from_settings(BenchSettings(quick=True), tmp_path)
