"""Trainings of the original algorithm, their curves and their best rate."""

import json

import pytest

from benchmarks import original


def write_metrics(run, rewards):
    run.mkdir(parents=True, exist_ok=True)
    lines = [f"{i + 1},{reward}" for i, reward in enumerate(rewards)]
    (run / "metrics.csv").write_text("\n".join(["episodes,train/running_reward", *lines]))


def test_the_best_training_solves_most_seeds_and_is_not_the_default(tmp_path, monkeypatch):
    given = {}

    def train_seeds(folder, settings, seeds):
        given[folder.name] = settings
        for seed in seeds:
            write_metrics(folder / str(seed), [0.5, 2.99])
        solves = {"default": 5, "constant 0.0001": 3, "step_decay 3e-05": 1}.get(folder.name, 0)
        return [{"solved": seed < solves, "verdict": "good"} for seed in seeds]

    monkeypatch.setattr(original, "train_seeds", train_seeds)
    found = original.bench_original(tmp_path, tmp_path / "original.png", False)
    assert (found["original_best"], found["original_solved"]) == ("constant 0.0001", 3)
    assert found["original_seeds"] == 5 and len(found["original_runs"]) == 7
    assert given["default"] == []
    assert given["step_decay 0.001"] == [
        "experiment=original",
        "scheduler=step_decay",
        "optimizer.lr=0.001",
        "trainer.total_episodes=5000",
    ]
    assert given["constant 3e-05"][-1] == "trainer.total_episodes=30000"
    assert (tmp_path / "original.png").stat().st_size > 10_000


def test_quick_trainings_are_short():
    assert "trainer.total_episodes=20" in original.trainings(True)["constant 0.0001"]


def test_the_schedule_has_ended_where_trainings_with_it_stop():
    """0.99 ** 1000 = 4.3e-5."""
    assert pytest.approx(4.317e-5, rel=1e-3) == 0.99 ** (original.FROZEN / 5)


def test_runs_are_trained_and_judged_once(tmp_path, monkeypatch):
    trained = []

    def train(run, *settings):
        trained.append((run.name, *settings))
        run.mkdir(parents=True)
        return 2.5, {"reason": "episodes", "episodes": 20, "frames": 600}

    def call(name, policy, *args, statuses):
        folder = tmp_path / policy[-1] / "verdict"
        folder.mkdir()
        (folder / "verdict.json").write_text('{"kind": "poor", "certain": false}')

    monkeypatch.setattr(original, "train", train)
    monkeypatch.setattr(original, "call", call)
    (tmp_path / "1").mkdir()  # interrupted
    known = {"solved": True, "verdict": "good"}
    (tmp_path / "2").mkdir()
    (tmp_path / "2" / "outcome.json").write_text(json.dumps(known))
    found = original.train_seeds(tmp_path, ["optimizer.lr=1"], [0, 1, 2])
    assert sorted(trained) == [("0", "optimizer.lr=1", "seed=0"), ("1", "optimizer.lr=1", "seed=1")]
    assert not found[0]["solved"] and found[1]["verdict"] == "poor (not certain)"
    assert found[2] == known
    assert original.train_seeds(tmp_path, [], [0, 1, 2]) == found
    assert len(trained) == 2


def test_curves_are_thinned_and_keep_their_ends(tmp_path):
    write_metrics(tmp_path, [i / 1000 for i in range(1000)])
    curve = original.read_curve(tmp_path)
    assert curve[0] == (1, 0.0) and curve[-1] == (1000, 0.999)
    assert len(curve) <= 201
