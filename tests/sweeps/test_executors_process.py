"""One run in a process of its own: begun, gone on with, waited for, stopped, given up."""

import json
import signal
import sys
import threading
import time

import pytest

from drone_rl.sweeps import executors
from drone_rl.sweeps.executors import RunProcess, describe_active, finish_run, note_failure
from drone_rl.sweeps.manifest import Run, Sweep, read_failure
from drone_rl.utils.files import folder_lock
from drone_rl.utils.readers import read_result

pytestmark = pytest.mark.usefixtures("fake_training")


def test_a_run_that_was_stopped_is_not_finished(make_runs):
    (run,) = make_runs("seed=0")
    run.folder.mkdir()
    (run.folder / "result.json").write_text(json.dumps({"reason": "SIGTERM"}))
    assert read_result(run.folder) is None


def test_a_failure_is_forgotten_when_the_run_succeeds(make_runs):
    (run,) = make_runs("seed=0")
    run.folder.mkdir()
    run.failure.write_text(json.dumps({"error": "no space left"}))
    assert finish_run(run) == 0
    assert read_failure(run) is None


def test_a_run_works_in_the_given_folder(make_runs, monkeypatch, tmp_path):
    code = "import os, sys; sys.exit('error: ' + os.getcwd())"
    monkeypatch.setattr(executors, "PROGRAM", (sys.executable, "-c", code))
    (run,) = make_runs("seed=0")
    (tmp_path / "project").mkdir()
    assert finish_run(run, tmp_path / "project") != 0
    assert read_failure(run) == str((tmp_path / "project").resolve())


def test_a_run_that_another_process_works_on_is_waited_for(make_runs):
    (run,) = make_runs("seed=0")
    run.folder.mkdir()
    statuses = []
    with folder_lock(run.folder):
        thread = threading.Thread(target=lambda: statuses.append(finish_run(run)))
        thread.start()
        time.sleep(0.5)
        assert not statuses
        result = {"reason": "solved", "running_reward": 2.0}
        (run.folder / "result.json").write_text(json.dumps(result))
    thread.join(10)
    assert statuses == [0]
    assert not (run.folder / "starts").exists()


def test_runs_at_work_are_described_by_their_last_line(tmp_path):
    runs = [Run(i, (), tmp_path / f"lr{i}" / "0") for i in range(3)]
    sweep = Sweep(tmp_path, "drone-rl train -m", {}, runs)
    for run in runs:
        run.folder.mkdir(parents=True)
        (run.folder / "output.log").write_text("[10:00:00] begins\n[10:00:05] frames 2\n")
    (runs[1].folder / "output.log").write_text("")
    assert describe_active(sweep, runs) == ""
    with folder_lock(runs[0].folder), folder_lock(runs[1].folder):
        assert describe_active(sweep, runs) == "lr0/0: frames 2; lr1/0: starts"
        assert describe_active(sweep, runs, most=1) == "lr0/0: frames 2; and 1 more"


def test_a_process_that_came_too_late_is_no_failure(make_runs):
    (run,) = make_runs("fail=true")
    process = RunProcess(run)
    assert process.poll() is None
    result = {"reason": "solved", "running_reward": 2.0}
    (run.folder / "result.json").write_text(json.dumps(result))  # by an earlier sweep's process
    assert process.wait() == 0
    assert read_failure(run) is None


@pytest.mark.parametrize(
    ("program", "error"),
    [
        ("print('error: first'); print('note'); sys.exit('error: second')", "second"),
        ("print('only words'); print(' '); sys.exit(3)", "only words"),
        ("sys.exit(3)", "ended with status 3"),
        ("os.kill(os.getpid(), signal.SIGKILL)", "ended by signal SIGKILL"),
    ],
)
def test_the_line_that_says_why_a_run_failed_is_kept(make_runs, monkeypatch, program, error):
    code = f"import os, signal, sys; {program}"
    monkeypatch.setattr(executors, "PROGRAM", (sys.executable, "-u", "-c", code))
    (run,) = make_runs("seed=0")
    assert finish_run(run) != 0
    assert read_failure(run) == error


def test_a_run_that_is_stopped_ends_by_sigterm(make_runs):
    (run,) = make_runs("sleep=60")
    started = RunProcess(run)
    started.stop()  # nothing to stop yet
    assert started.poll() is None
    while not (run.folder / "starts").exists():
        time.sleep(0.02)
    started.stop()
    started.join()
    assert started.poll() == -signal.SIGTERM
    assert read_result(run.folder) is None


def test_a_run_has_one_thread_and_no_input(make_runs, monkeypatch):
    code = "import os, sys; sys.exit('error: ' + os.environ['OMP_NUM_THREADS'] + sys.stdin.read())"
    monkeypatch.setattr(executors, "PROGRAM", (sys.executable, "-c", code))
    (run,) = make_runs("seed=0")
    finish_run(run)
    assert read_failure(run) == "1"


def test_a_reason_is_kept_where_no_folder_was(make_runs):
    (run,) = make_runs("seed=0")
    note_failure(run, "lost")
    assert json.loads(run.failure.read_text()) == {"error": "lost"}


def test_an_earlier_failure_is_not_the_reason_of_a_later_one(make_runs, monkeypatch):
    (run,) = make_runs("seed=0")
    for program, error in (
        ("sys.exit('error: disk full')", "disk full"),
        ("sys.exit(3)", "ended with status 3"),
    ):
        code = f"import sys; {program}"
        monkeypatch.setattr(executors, "PROGRAM", (sys.executable, "-c", code))
        assert finish_run(run) != 0
        assert read_failure(run) == error
