import csv
import types

import pytest
from torchrl.record.loggers.csv import CSVLogger

from drone_rl.training import (
    CheckpointCallback,
    CsvCallback,
    LoggerCallback,
    callbacks,
)
from drone_rl.training.callbacks import CollapseCheck, TrainingProgress
from drone_rl.utils.checkpoint import load_checkpoint, save_checkpoint
from drone_rl.utils.errors import InputError
from tests.training_loop import run


def rows(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_last_and_best_checkpoints_are_kept(make_trainer, tmp_path):
    trainer = make_trainer(callbacks=[CheckpointCallback(tmp_path, interval_s=0.0)])
    run(trainer)
    last, best = (load_checkpoint(tmp_path / name) for name in ("last.pt", "best.pt"))
    assert last["progress"]["updates"] == trainer.progress.updates
    assert best["progress"]["running_reward"] >= last["progress"]["running_reward"]
    assert best["best"] == best["progress"]["running_reward"]


def test_a_best_state_that_was_not_saved_is_not_noted_in_the_last(
    make_trainer, tmp_path, monkeypatch
):
    callback, trainer = CheckpointCallback(tmp_path, interval_s=0.0), make_trainer()
    callback.on_start(trainer)
    callback.on_update(trainer, {})

    def save(path, state):
        if path == callback.best_path:
            raise InputError("no space left")
        save_checkpoint(path, state)

    monkeypatch.setattr(callbacks, "save_checkpoint", save)
    trainer.progress.running_reward += 1.0
    with pytest.raises(InputError, match="no space left"):
        callback.on_update(trainer, {})
    last, best = (load_checkpoint(tmp_path / name) for name in ("last.pt", "best.pt"))
    assert last["best"] == best["progress"]["running_reward"]


def test_metrics_have_one_row_per_update(make_trainer, tmp_path):
    trainer = make_trainer(callbacks=[CsvCallback(tmp_path / "metrics.csv")])
    run(trainer)
    table = rows(tmp_path / "metrics.csv")
    assert [int(r["update"]) for r in table] == list(range(1, trainer.progress.updates + 1))
    assert float(table[-1]["train/running_reward"]) == pytest.approx(
        trainer.progress.running_reward, rel=1e-4
    )


def test_resumed_run_has_each_row_once(make_trainer, tmp_path):
    path = tmp_path / "metrics.csv"
    first = make_trainer(callbacks=[CsvCallback(path)], total_frames=100)
    run(first)
    state = first.state_dict()
    first.total_frames = 200
    run(first)  # rows after the last checkpoint
    resumed = make_trainer(callbacks=[CsvCallback(path)], total_frames=300)
    resumed.load_state_dict(state)
    run(resumed)
    updates = [int(r["update"]) for r in rows(path)]
    assert updates == list(range(1, resumed.progress.updates + 1))


def test_a_run_without_updates_has_a_header_that_a_longer_run_replaces(make_trainer, tmp_path):
    path = tmp_path / "metrics.csv"
    run(make_trainer(callbacks=[CsvCallback(path)], total_frames=0))
    assert path.read_text() == "update,frames,episodes,seconds,train/running_reward\n"
    run(make_trainer(callbacks=[CsvCallback(path)], total_frames=0))
    assert rows(path) == []
    longer = make_trainer(callbacks=[CsvCallback(path)], total_frames=100)
    run(longer)
    updates = [int(row["update"]) for row in rows(path)]
    assert updates == list(range(1, longer.progress.updates + 1))
    assert "loss/grad_norm" in rows(path)[0]


METRICS = {"cloning/loss": 0.25, "cloning/held_out_accuracy": 0.5}


def test_passes_over_demonstrations_have_rows_of_their_own(tmp_path):
    (tmp_path / "cloning.csv").write_text("of an earlier run\n" * 9)
    callback = CsvCallback(tmp_path / "metrics.csv")
    for epoch in (1, 2):
        callback.on_clone(epoch, 2, {**METRICS, "cloning/loss": 0.5 / epoch})
    assert rows(tmp_path / "cloning.csv") == [
        {"epoch": "1", "cloning/loss": "0.5", "cloning/held_out_accuracy": "0.5"},
        {"epoch": "2", "cloning/loss": "0.25", "cloning/held_out_accuracy": "0.5"},
    ]
    assert not (tmp_path / "metrics.csv").exists()


def collapse(updates, episodes=10, target=3.0, **metrics):
    """A check after updates of (entropy, running reward), with so many episodes each."""
    check, progress = CollapseCheck(target, "end/success"), TrainingProgress()
    training = types.SimpleNamespace(progress=progress)
    check.on_start(training)
    for entropy, reward in updates:
        progress.frames, progress.episodes = progress.frames + 100, progress.episodes + episodes
        progress.updates, progress.running_reward = progress.updates + 1, reward
        entropies = {"loss/entropy": entropy} if entropy is not None else {}
        check.on_update(training, entropies | metrics)
    return check


# 500 episodes are 50 updates of 10; a rise of 0.03 is 1% of the target; 2.7 is 90% of it
LEARNING = [(1.0, 0.5), (0.5, 1.5)]
STUCK = [(0.001, 1.5)]


@pytest.mark.parametrize(
    ("updates", "collapsed_at"),
    [
        (LEARNING + STUCK * 49, None),
        (LEARNING + STUCK * 50, 5200),
        (LEARNING + STUCK * 30 + [(0.1, 1.5)] + STUCK * 49, None),  # explores in between
        (LEARNING + STUCK * 40 + [(0.001, 1.6)] * 40, None),  # improves in between
        ([(0.0, 0.78 - 0.5**n) for n in range(99)], 6100),  # settles: rises by 0.03 until n = 10
        ([(0.0, 2.8)] * 300, None),  # deterministic and good
        ([(1.0, 0.5)] * 300, None),  # explores
        ([(None, 0.5)] * 300, None),  # a learner that logs no entropy
    ],
)
def test_a_deterministic_policy_that_does_not_improve_has_collapsed(caplog, updates, collapsed_at):
    check = collapse(updates)
    assert check.collapsed_at == collapsed_at
    assert len(caplog.records) == (collapsed_at is not None)


def test_without_a_target_the_success_rate_tells_a_collapse():
    assert collapse(STUCK * 60, target=None, **{"end/success": 0.4}).collapsed_at == 5100
    assert collapse(STUCK * 60, target=None, **{"end/success": 0.95}).collapsed_at is None


def test_torchrl_loggers_are_supported(make_trainer, tmp_path):
    logger = CSVLogger("run", log_dir=str(tmp_path))
    run(make_trainer(callbacks=[LoggerCallback([logger])]))
    assert list(tmp_path.glob("run/scalars/**/*reward*.csv"))
