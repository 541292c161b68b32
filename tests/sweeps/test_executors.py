"""Executors of runs, and the process of one run."""

import json
import signal
import sys
import threading
import time
import types

import pytest

from drone_rl.sweeps import executors
from drone_rl.sweeps.executors import (
    LocalExecutor,
    RayExecutor,
    RunProcess,
    SlurmExecutor,
    finish_run,
)
from drone_rl.sweeps.manifest import read_failure
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import folder_lock
from drone_rl.utils.provenance import num_cores
from drone_rl.utils.run_result import read_result

pytestmark = pytest.mark.usefixtures("fake_training")


def starts(run):
    return (run.folder / "starts").read_text().split()


def test_all_runs_end_and_one_that_fails_stops_no_other(make_runs):
    runs = make_runs("seed=0", "fail=true", "seed=2")
    ended = dict(LocalExecutor(2).finish(runs))
    assert [ended[run] for run in runs] == [0, 1, 0]
    assert read_failure(runs[1]) == "fail=true is a mistake"
    assert read_failure(runs[0]) is None
    assert read_result(runs[1].folder) is None


def test_as_many_runs_as_allowed_overlap(make_runs):
    runs = make_runs("until=1", "until=0", "until=3", "until=2")  # each waits for another to start
    ended = dict(LocalExecutor(2).finish(runs))
    assert [ended[run] for run in runs] == [0, 0, 0, 0]


def test_finished_runs_are_left_alone_and_half_finished_ones_resumed(make_runs):
    runs = make_runs("seed=0", "seed=1", "seed=2")
    finish_run(runs[0])
    (runs[1].folder / "checkpoints").mkdir(parents=True)
    runs[1].checkpoint.touch()
    runs[2].folder.mkdir()
    (runs[2].folder / "result.json").write_text("{cut sho")
    list(LocalExecutor(2).finish(runs))
    assert [starts(run) for run in runs] == [["begun"], ["resumed"], ["begun"]]


MEET = """
import pathlib, signal, sys, time
folder = pathlib.Path(dict(a.split("=", 1) for a in sys.argv[2:])["hydra.run.dir"].strip("'"))

def wait_for_all(name, count):
    begin = time.monotonic()
    while len([*folder.parent.glob(f"*/{name}")]) < count:
        if time.monotonic() - begin > 20:
            sys.exit(1)
        time.sleep(0.01)

def stop(*_):
    (folder / "stopping").touch()
    wait_for_all("stopping", 2)
    (folder / "met").touch()
    sys.exit(0)

signal.signal(signal.SIGTERM, stop)
if folder.name == "0":
    wait_for_all("ready", 2)
else:
    (folder / "ready").touch()
    time.sleep(60)
"""


def test_runs_of_an_interrupted_sweep_stop_at_the_same_time(make_runs, monkeypatch):
    monkeypatch.setattr(executors, "PROGRAM", (sys.executable, "-c", MEET))
    runs = make_runs("seed=0", "seed=1", "seed=2")
    ends = LocalExecutor(3).finish(runs)
    assert next(ends) == (runs[0], 0)
    ends.close()
    assert all((run.folder / "met").exists() for run in runs[1:])


def slurm(folder):
    pytest.importorskip("submitit", reason="pip install -e '.[slurm]'")
    return SlurmExecutor(folder / "jobs", cluster="local", num_jobs=2, resources={"timeout_min": 5})


def ray(folder):
    pytest.importorskip("ray", reason="pip install -e '.[ray]'")
    return RayExecutor(address=None, num_cpus=1, num_gpus=0)


@pytest.mark.slow
@pytest.mark.parametrize("cluster", [slurm, ray])
def test_clusters_of_this_machine(make_runs, tmp_path, cluster):
    executor = cluster(tmp_path)
    finished, lost = make_runs("seed=0", "seed=1")
    finished.folder.mkdir()
    result = json.dumps({"reason": "solved", "largest_reward": 3})
    (finished.folder / "result.json").write_text(result)
    (lost.folder / "output.log").mkdir(parents=True)  # where nothing can be started
    assert dict(executor.finish([finished, lost])) == {finished: 0, lost: 1}
    assert "was lost" in read_failure(lost)
    assert "output.log" in read_failure(lost)


@pytest.mark.parametrize("setting", [{"partitio": "gpu"}, {"timeout_min": 2.5}])
def test_settings_that_submitit_refuses(tmp_path, setting):
    pytest.importorskip("submitit", reason="pip install -e '.[slurm]'")
    (name,) = setting
    with pytest.raises(InputError, match=rf"submitit refuses .*{name}.*\+hydra.launcher.slurm_"):
        SlurmExecutor(tmp_path, cluster="local", num_jobs=2, resources=setting)


def fake_ray(calls):
    task = types.SimpleNamespace(remote=lambda *args: calls.append(args) or len(calls))
    return types.SimpleNamespace(
        is_initialized=lambda: True,
        init=lambda **_: None,
        remote=lambda **_: lambda function: task,
        wait=lambda tasks: (tasks, []),
        get=lambda task: 0,
    )


def test_runs_on_ray_work_in_the_folder_of_the_sweep(make_runs, monkeypatch, tmp_path):
    calls = []
    monkeypatch.setitem(sys.modules, "ray", fake_ray(calls))
    monkeypatch.chdir(tmp_path)
    (run,) = make_runs("seed=0")
    assert dict(RayExecutor(address=None, num_cpus=1, num_gpus=0).finish([run])) == {run: 0}
    assert calls == [(run, tmp_path.resolve())]


def test_at_least_one_job():
    with pytest.raises(InputError, match="num_jobs=0"):
        LocalExecutor(0)
    assert LocalExecutor(1).num_jobs == 1
    assert LocalExecutor().num_jobs == num_cores()


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
        result = {"reason": "solved", "running_reward": 2.0, "largest_reward": 3}
        (run.folder / "result.json").write_text(json.dumps(result))
    thread.join(10)
    assert statuses == [0]
    assert not (run.folder / "starts").exists()


def test_a_process_that_came_too_late_is_no_failure(make_runs):
    (run,) = make_runs("fail=true")
    process = RunProcess(run)
    assert process.poll() is None
    result = {"reason": "solved", "running_reward": 2.0, "largest_reward": 3}
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
def test_the_reason_of_a_failure(make_runs, monkeypatch, program, error):
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
