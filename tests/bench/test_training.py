"""Figures of whole trainings: what is read, and the line through what is measured."""

import csv
import json

import numpy as np
import pytest

from drone_rl.bench import training
from drone_rl.bench.training import bench_memory, bench_solve, growth


def test_growth_by_hand():
    """2 MiB in 20,000 frames, once it has settled."""
    samples = [(0, 300.0), (50, 500.0), (100, 600.0), (10_100, 601.0), (20_100, 602.0)]
    assert growth(samples, 100) == pytest.approx(100.0)


@pytest.mark.parametrize("leak", [0.0, 20.0])
def test_swings_are_no_growth_and_hide_none(leak):
    """Up to 100 MiB come and go with each batch, ever more often; the leak stays."""
    random = np.random.default_rng(0)
    frames = np.linspace(0, 1_000_000, 400)
    swing = np.where(random.random(400) < 0.3 + 0.6 * frames / 1e6, random.random(400) * 100, 0.0)
    samples = list(zip(frames, 600 + leak * frames / 1e6 + swing, strict=True))
    assert growth(samples, 0) == pytest.approx(leak, abs=3.0)
    assert abs(np.polyfit(*zip(*samples, strict=True), 1)[0] * 1e6 - leak) > 20  # a line alone


def test_samples_that_do_not_count():
    settled = [(100, 600.0), (200, 600.0), (300, 600.0)]
    assert growth([(99, 1.0), *settled, (400, 0.0)], 100) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("samples", [[], [(100, 5.0), (200, 6.0)], [(100, 5.0)] * 5])
def test_too_few_samples(samples):
    assert growth(samples, 100) is None


class Finished:
    """A training that is over at the second look."""

    def __init__(self, command, **kwargs):
        self.command, self.looks, self.pid, self.returncode = command, 0, 1, Finished.status
        Finished.last = self

    def poll(self):
        self.looks += 1
        return None if self.looks < 5 else 0


@pytest.fixture
def watched(monkeypatch, tmp_path):
    """Every look finds 100,000 frames more and 10 MiB more; a peak of 777 MiB."""
    Finished.status = 0
    monkeypatch.setattr(training.subprocess, "Popen", Finished)
    monkeypatch.setattr(training.time, "sleep", lambda _: None)
    monkeypatch.setattr(
        training,
        "memory_status",
        lambda pid: {"VmHWM": 777.0, "VmRSS": 500.0 + 10 * Finished.last.looks},
    )
    monkeypatch.setattr(training, "_frames", lambda path: 100_000 * Finished.last.looks)
    return tmp_path


def test_memory_after_it_settled(watched):
    result = bench_memory(watched, 1_000_000, "cpu", False)
    assert result == {
        "peak_memory_mib": 777.0,
        "memory_growth_mib_per_million_frames": pytest.approx(100.0),
        "memory_frames": 1_000_000,
    }
    assert "trainer.total_frames=1100000" in Finished.last.command


def test_memory_of_a_training_that_failed(watched):
    Finished.status = 1
    with pytest.raises(RuntimeError, match="failed: 1"):
        bench_memory(watched, 1_000_000, "cpu", True)


def test_frames_of_the_last_row(tmp_path):
    path = tmp_path / "metrics.csv"
    assert training._frames(path) == 0
    with path.open("w", newline="") as file:
        csv.writer(file).writerows([["update", "frames"], [1, 500], [2, 1000]])
    assert training._frames(path) == 1000
    path.write_text("update,frames\n1,500\n2")  # a row that is being written
    assert training._frames(path) == 0


def test_solving_gathers_what_each_seed_left(monkeypatch, tmp_path):
    commands = []

    def call(*command):
        commands.append(command)
        name = "result.json" if command[0] == "train" else "evaluation.json"
        folder = tmp_path / next(c for c in command if "run.dir" in c).split("=")[1]
        folder.mkdir(parents=True, exist_ok=True)
        lower = {"greedy": {"success": {"lower95": 0.9}}}
        (folder / name).write_text(
            json.dumps({"frames": 10 * len(commands), "reason": "solved", **lower})
        )

    monkeypatch.setattr(training, "call", call)
    result = bench_solve(tmp_path, [3, 4], 100, "cpu", False)
    assert [c[0] for c in commands] == ["train", "evaluate"] * 2
    assert "seed=3" in commands[0] and "seed=4" in commands[2]
    assert (result["seeds_solved"], result["seeds_tried"]) == (2, 2)
    assert result["frames_to_solve"] == [10, 30]
    assert result["success_lower95"] == [0.9, 0.9]
    assert len(result["time_to_solve_s"]) == 2
    assert len(bench_solve(tmp_path, [3, 4], 100, "cpu", True)["frames_to_solve"]) == 1
