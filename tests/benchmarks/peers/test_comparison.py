"""Comparison of learners, with short trainings."""

import subprocess

import pytest

from benchmarks.peers import comparison
from benchmarks.peers.comparison import bench_peers, train_ours, train_theirs
from benchmarks.peers.settings import LABELS, OURS, THEIRS
from tests.forked import run_module_forked

KEYS = {"seconds", "seconds_without_imports", "frames", "is_solved", "curve", "success_lower95"}


def test_learners_alternate_for_each_seed(tmp_path, monkeypatch):
    calls = []

    def measured(name, seed, episodes):
        calls.append((name, seed, episodes))
        seconds = (10.0 if name in OURS else 20.0 if name == "sb3_a2c" else 12.0) + seed
        found = {"seconds": seconds, "seconds_without_imports": 5.0, "is_solved": True}
        return {**found, "curve": [(5.0, 0.8), (seconds, 2.97)]}

    def ours(arguments, *, seed, episodes, folder):
        short = () if episodes else ("trainer.total_frames=1",)
        assert tuple(arguments) == (*OURS[folder.name], *short)
        return measured(folder.name, seed, episodes)

    def theirs(name, settings, *, seed, episodes, max_frames):
        assert (settings, max_frames) == (THEIRS[name], 1_000_000 if episodes else 1)
        return measured(name, seed, episodes)

    monkeypatch.setattr(comparison, "train_ours", ours)
    monkeypatch.setattr(comparison, "train_theirs", theirs)
    figures = bench_peers(tmp_path / "runs" / "peers", [5, 4], 3, quick=False)
    found = figures["peers"]
    assert figures["solve_over_best_peer"] == pytest.approx(14.5 / 16.5)
    timed = [(name, seed, 3) for seed in (5, 4) for name in LABELS]
    assert calls == [*((name, 5, 0) for name in LABELS), *timed]
    assert [*found] == [*LABELS] and "curve" not in found["reinforce"]
    assert found["reinforce"]["seconds"] == [15.0, 14.0]
    assert (tmp_path / "peers.png").stat().st_size > 10_000


@pytest.fixture
def forked(monkeypatch):
    """Programs start in forks, which have imported the package already."""
    monkeypatch.setattr(subprocess, "run", run_module_forked)


def test_train_ours_runs_the_command(tmp_path, forked):
    short = ["trainer.total_frames=1", "collector.num_envs=2", "task.num_cubes=1"]
    found = train_ours(short, seed=1, episodes=2, folder=tmp_path)
    assert found.keys() == KEYS and not found["is_solved"]
    assert 0 < found["seconds_without_imports"] < found["seconds"]
    assert found["frames"] > 0 and 0 <= found["success_lower95"] < 1
    ((at, reward),) = found["curve"]
    assert 0 < at < found["seconds"] + 0.01 and 0 <= reward <= 1
    assert (tmp_path / "1" / "result.json").is_file()


def test_train_theirs_runs_a_third_party_training(forked):
    settings = {"num_envs": 2, "steps": 160}
    found = train_theirs("torchrl", settings, seed=1, episodes=2, max_frames=1)
    assert found.keys() == KEYS and found["frames"] == 320 and not found["is_solved"]
    ((at, reward),) = found["curve"]
    assert 0 < at < found["seconds"] and 0 <= reward <= 3


def test_a_failed_third_party_training_is_an_error(forked):
    with pytest.raises(RuntimeError, match="no_such failed"):
        train_theirs("no_such", {}, seed=0, episodes=1, max_frames=1)
