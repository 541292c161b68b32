"""Trainings with vehicle dynamics: settings, and keys with the experiment's name."""

from pathlib import Path

from benchmarks import training
from benchmarks.training import bench_flight_training


def test_keys_begin_with_the_name_of_the_experiment(monkeypatch):
    calls = []

    def train_and_evaluate(folder, seeds, settings, episodes, device):
        calls.append((folder, list(seeds), settings, episodes, device))
        return {
            "seconds": [30.0, 40.0],
            "frames": [100, 200],
            "lower95": [0.99, 0.9],
            "reason": ["solved", "frames"],
        }

    monkeypatch.setattr(training, "train_and_evaluate", train_and_evaluate)
    figures = bench_flight_training("flight", Path("runs"), [3, 4], 1000, "cpu", False)
    assert figures == {
        "flight_time_to_solve_s": [30.0, 40.0],
        "flight_frames": [100, 200],
        "flight_success_lower95": [0.99, 0.9],
        "flight_solved": 1,
    }
    assert calls == [(Path("runs"), [3, 4], ["experiment=flight"], 1000, "cpu")]
    bench_flight_training("flight_pillars", Path("runs"), [3, 4], 1000, "cpu", True)
    _, seeds, settings, episodes, _ = calls[1]
    assert seeds == [3] and episodes == 50
    assert settings[0] == "experiment=flight_pillars" and "trainer.total_frames=4000" in settings
