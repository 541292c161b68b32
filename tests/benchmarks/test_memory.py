"""Memory growth by hand, and a monitored training."""

import pytest

from benchmarks import memory
from benchmarks.memory import bench_memory, growth
from tests.forked import run_module_forked


def test_growth_by_hand():
    """2 MiB in 20,000 frames after settling."""
    samples = [(0, 300.0), (50, 500.0), (100, 600.0), (10_100, 601.0), (20_100, 602.0)]
    assert growth(samples, 100) == pytest.approx(100.0)


def test_samples_before_settling_are_ignored():
    settled = [(100, 600.0), (200, 600.0), (300, 600.0)]
    assert growth([(99, 1.0), *settled], 100) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("samples", [[], [(100, 5.0), (200, 6.0)], [(99, 1.0)] * 5])
def test_too_few_samples(samples):
    assert growth(samples, 100) is None


def test_the_memory_of_a_training_is_recorded(tmp_path, monkeypatch):
    monkeypatch.setattr(memory.subprocess, "run", run_module_forked)
    result = bench_memory(tmp_path, 1_000_000, "cpu", quick=True)
    assert 200 < result["peak_memory_mib"] < 4096
    assert isinstance(result["memory_growth_mib_per_million_frames"], float)
    assert result["memory_frames"] == 10_000
    assert (tmp_path / "memory" / "metrics.csv").is_file()


def test_a_failed_training_is_an_error(tmp_path, monkeypatch):
    monkeypatch.setattr(memory.sys, "executable", "false")
    with pytest.raises(RuntimeError, match="failed: status 1"):
        bench_memory(tmp_path, 1, "no such device", quick=True)
