"""Figures of sweeps, from hand-written files."""

import json
import subprocess
import sys
import time
from pathlib import Path

import pytest
import torch

from benchmarks import sweeps


def test_speed_up_and_overhead(monkeypatch, tmp_path):
    times = {"bare": 10.0, "sweep_1": 25.0, "sweep_2": 12.5}
    calls = []

    def seconds(program, *args):
        calls.append(args)
        return next(t for name, t in times.items() if any(f"/{name}" in a for a in args))

    monkeypatch.setattr(sweeps, "_seconds", seconds)
    found = sweeps.bench_sweeps(tmp_path, "cpu", quick=True)
    assert found["sweep_bare_s"] == 20.0  # two seeds
    assert found["sweep_speedup"] == 2.0
    assert found["launcher_overhead"] == pytest.approx(0.25)
    assert sum("-m" in args for args in calls) == 2


def test_the_collection_rate_excludes_the_first_batch(tmp_path):
    rows = "frames,time/collect_s\n100,50\n300,2\n500,2\n"
    (tmp_path / "m.csv").write_text(rows)
    assert sweeps._collected_rate(tmp_path / "m.csv") == 100.0


@pytest.fixture
def make_run(tmp_path, monkeypatch):
    """Return a factory of finished runs with a result and a weight."""
    monkeypatch.setattr(sweeps, "load_checkpoint", lambda path: torch.load(path, weights_only=True))

    def build(name, weight=1.0, **result):
        checkpoints = tmp_path / name / "checkpoints"
        checkpoints.mkdir(parents=True)
        torch.save({"policy": {"w": torch.tensor([weight])}}, checkpoints / "last.pt")
        result = {"reason": "frames", "seconds": 1.0, **result}
        (tmp_path / name / "result.json").write_text(json.dumps(result))
        return tmp_path / name

    return build


def test_outcomes_are_equal_except_for_the_time(make_run):
    first = sweeps._outcome(make_run("a"))
    assert sweeps._outcome(make_run("b", seconds=99.0)) == first
    assert sweeps._outcome(make_run("c", weight=1.0 + 2**-20)) != first
    assert sweeps._outcome(make_run("d", reason="solved")) != first


def test_only_processes_of_the_sweep_are_killed(tmp_path):
    code = "import time; time.sleep(60)"
    named, other = (
        subprocess.Popen([sys.executable, "-c", code, text])
        for text in (f"dir={tmp_path}/killed", f"dir={tmp_path}/spared")
    )
    while not Path(f"/proc/{named.pid}/cmdline").read_bytes():
        time.sleep(0.01)  # a new process has no command line yet
    try:
        sweeps._kill_processes(f"{tmp_path}/killed")
        assert named.wait(10) == -9
        assert other.poll() is None
    finally:
        other.kill()
        other.wait()


def test_without_ray_the_figures_are_none(monkeypatch, tmp_path):
    monkeypatch.setattr(sweeps.importlib.util, "find_spec", lambda name: None)
    found = sweeps.bench_ray(tmp_path, "cpu", quick=True)
    assert found == {"ray_fps": None, "ray_over_plain": None}


def test_ray_is_compared_with_the_default_collector_alternately(monkeypatch, tmp_path):
    monkeypatch.setattr(sweeps.importlib.util, "find_spec", lambda name: object())
    order = []
    monkeypatch.setattr(sweeps, "_seconds", lambda program, *args: order.append(args[0]))
    rates = {"episodes_0": 10.0, "ray_0": 11.0, "episodes_1": 5.0, "ray_1": 6.0}
    rates |= {"episodes_2": 20.0, "ray_2": 18.0}
    monkeypatch.setattr(sweeps, "_collected_rate", lambda path: rates[path.parent.name])
    found = sweeps.bench_ray(tmp_path, "cpu", quick=False)
    assert order == ["collector=episodes", "collector=ray"] * 3
    assert found["ray_over_plain"] == pytest.approx(1.1)  # of 1.1, 1.2 and 0.9
    assert found["plain_beside_ray_fps"] == 10.0
