"""Comparison with learners of other libraries, by short trainings."""

import dataclasses

import numpy as np
import pytest

import drone_rl
from benchmarks.peers import comparison
from benchmarks.peers.comparison import bench_peers, train_ours
from benchmarks.peers.program import PEERS, success_lower95
from benchmarks.peers.settings import LABELS, OURS, THEIRS
from drone_rl.utils.run_result import RunResult


def test_learners_alternate_for_each_seed(setup, monkeypatch):
    setup = dataclasses.replace(setup, seeds=(5, 4), episodes=3, quick=False)
    calls = []

    def measured(name, seed, episodes):
        calls.append((name, seed, episodes))
        seconds = (10.0 if name in OURS else 20.0 if name == "sb3_a2c" else 12.0) + seed
        return {"seconds": seconds, "is_solved": True, "curve": [(5.0, 0.8), (seconds, 2.97)]}

    def ours(arguments, *, seed, episodes, folder):
        return measured(folder.name, seed, episodes)

    def theirs(name, settings, *, seed, episodes, max_frames):
        return measured(name, seed, episodes)

    monkeypatch.setattr(comparison, "train_ours", ours)
    monkeypatch.setattr(comparison, "train_theirs", theirs)
    figures = bench_peers(setup)
    assert figures["solve_over_best_peer"] == pytest.approx(14.5 / 16.5)
    timed = [(name, seed, 3) for seed in (5, 4) for name in LABELS]
    assert calls == [*((name, 5, 0) for name in LABELS), *timed]
    assert figures["peers"]["reinforce"]["seconds"] == [15.0, 14.0]
    assert [*THEIRS] == [*PEERS] and [*LABELS] == [*OURS, *THEIRS]
    assert (setup.folder / "peers.png").stat().st_size > 10_000


def test_our_training_is_measured(tmp_path, monkeypatch):
    """The command takes 3 s, of which 1 s is training."""

    def train(run, *arguments):
        run.mkdir()
        (run / "metrics.csv").write_text("seconds,train/running_reward\n0.5,1.5\n")
        return 3.0, RunResult(reason="frames", frames=8, seconds=1.0, largest_reward=3)

    monkeypatch.setattr(comparison, "train", train)
    measured = train_ours([], seed=1, episodes=0, folder=tmp_path)
    assert (measured["seconds"], measured["seconds_without_imports"]) == (3.0, 1.0)
    assert (measured["curve"], measured["is_solved"]) == ([(2.5, 1.5)], False)


def test_the_lower_bound_of_ten_successes():
    good = drone_rl.load_policy("good")
    assert success_lower95(good, 10) == pytest.approx(0.025 ** (1 / 10))  # 10 of 10


def test_the_running_mean_counts_whole_episodes_in_the_order_of_their_ends():
    pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is not installed")
    from benchmarks.peers.sb3 import Solved

    solved = Solved(target=2.0, decay=0.5)
    solved.count(np.array([1.0, 0.0]), np.array([False, False]))
    solved.count(np.array([2.0, 1.0]), np.array([True, True]))  # episodes of 3 and of 1
    assert (solved.running_reward, solved.episodes) == ((0.5 * 3) * 0.5 + 0.5 * 1, 2)
    solved.count(np.array([1.0, 2.0]), np.array([False, True]))  # one of 2
    assert (solved.running_reward, solved.is_reached) == (1.625, False)
    solved.count(np.array([2.0, 0.0]), np.array([True, False]))  # one of 3
    assert (solved.running_reward, solved.is_reached) == (2.3125, True)
