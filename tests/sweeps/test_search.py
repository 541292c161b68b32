"""The search's study: it repeats, resumes after a kill, and prunes unpromising runs."""

from types import SimpleNamespace

import pytest

optuna = pytest.importorskip("optuna", reason="pip install -e '.[optuna]'")

from drone_rl.sweeps import search  # noqa: E402
from drone_rl.sweeps.pruning import TrialCallback  # noqa: E402
from drone_rl.sweeps.search import next_trials, note_outcome, open_study  # noqa: E402
from drone_rl.utils.errors import InputError  # noqa: E402
from drone_rl.utils.files import refuse_links  # noqa: E402
from drone_rl.utils.run_result import RunResult  # noqa: E402

SPACE = {"optimizer.lr": optuna.distributions.FloatDistribution(1e-4, 1e-1, log=True)}


def begin(folder, **attributes):
    folder.mkdir(exist_ok=True)
    study = open_study(folder, direction="maximize")
    defaults = {"prune": True, "startup_trials": 1, "report_frames": 100}
    for name, value in {**defaults, **attributes}.items():
        study.set_user_attr(name, value)
    return study


def params(trials):
    return [trial.params for trial in trials]


def ended(reason, reward, **figures):
    return RunResult(reason=reason, running_reward=reward, largest_reward=3, **figures)


def test_a_killed_search_resumes_its_trials(tmp_path):
    first = next_trials(begin(tmp_path), SPACE, 3, seed=0)
    study = begin(tmp_path)  # a new process
    assert params(next_trials(study, SPACE, 3, seed=0)) == params(first)
    note_outcome(study, 1, ended("frames", 2.0))
    assert [t.number for t in next_trials(study, SPACE, 3, seed=0)] == [0, 1, 2]


def test_the_lock_of_the_journal_is_no_link(tmp_path):
    lock = begin(tmp_path)._storage._backend._lock
    lock.acquire()
    try:
        refuse_links(tmp_path)
    finally:
        lock.release()


def test_the_same_results_give_the_same_trials(tmp_path):
    sampled = []
    for name in "ab":
        study = begin(tmp_path / name)
        for number in (0, 1):
            next_trials(study, SPACE, 1, seed=0)
            note_outcome(study, number, ended("frames", float(number)))
        sampled.append(params(next_trials(study, SPACE, 2, seed=0)))
    assert sampled[0] == sampled[1]


def test_outcomes_of_trials(tmp_path):
    study = begin(tmp_path)
    next_trials(study, SPACE, 3, seed=0)
    note_outcome(study, 0, ended("solved", 2.97))
    note_outcome(study, 1, ended("pruned", 0.1))
    note_outcome(study, 2, None)
    note_outcome(study, 2, None)
    assert [t.state.name for t in study.trials] == ["COMPLETE", "PRUNED", "FAIL"]
    assert study.best_value == 2.97


def test_a_search_by_success_takes_it_from_confirmation_episodes_of_the_last_policy(tmp_path):
    study = begin(tmp_path, metric="success")
    next_trials(study, SPACE, 2, seed=0)
    confirmed = []
    progress = SimpleNamespace(updates=7)
    training = SimpleNamespace(progress=progress, confirm=confirmed.append)
    callback = TrialCallback(tmp_path, 0)
    for reason in ("frames", "solved", "SIGTERM"):
        callback.on_end(training, reason)
    assert confirmed == [7]
    confirmations = {"confirming_flights": 200, "confirming_flights_succeeded": 150}
    note_outcome(study, 0, ended("frames", 9.0, **confirmations))
    note_outcome(study, 1, ended("frames", 9.0))
    assert [t.value for t in study.trials] == [0.75, None]


@pytest.mark.parametrize("content", [b"{}\n", b'{"op_code": 4}\n', b"[" * 10_000 + b"\n"])
def test_a_damaged_journal_is_refused(tmp_path, content):
    next_trials(begin(tmp_path), SPACE, 1, seed=0)
    with (tmp_path / "optuna.journal").open("ab") as file:
        file.write(content)
    with pytest.raises(InputError, match=r"optuna\.journal is damaged"):
        open_study(tmp_path)


def test_a_journal_that_is_too_large_or_no_file_is_refused(tmp_path, monkeypatch):
    next_trials(begin(tmp_path), SPACE, 1, seed=0)
    monkeypatch.setattr(search, "JOURNAL_BYTES", 100)
    with pytest.raises(InputError, match="too large"):
        open_study(tmp_path)
    (tmp_path / "optuna.journal").unlink()
    (tmp_path / "optuna.journal").mkdir()
    with pytest.raises(InputError, match="Is a directory"):
        open_study(tmp_path, direction="maximize")


@pytest.mark.parametrize(("prune", "reason"), [(True, "pruned"), (False, "")])
def test_a_run_below_the_median_is_stopped(tmp_path, prune, reason):
    study = begin(tmp_path, prune=prune)
    next_trials(study, SPACE, 2, seed=0)
    reasons = []
    for number, reward in ((0, 2.0), (1, 0.5)):
        progress = SimpleNamespace(frames=0, running_reward=reward)
        trainer = SimpleNamespace(progress=progress, stop_request="")
        callback = TrialCallback(tmp_path, number)
        for frames in (50, 120, 130, 250):
            progress.frames = frames
            callback.on_update(trainer, {})
        reasons.append(trainer.stop_request)
        note_outcome(study, number, ended(trainer.stop_request or "frames", reward))
    assert reasons == ["", reason]
    assert list(study.trials[0].intermediate_values) == [1, 2]
