"""What a sweeper gets to see of a run; whole sweeps are in tests/cli/test_sweeps."""

import json
import logging
import os
import signal
import sys

import pytest

from drone_rl.cli.hydra.launchers import (
    SweepLauncher,
    _command,
    _job_return,
    _outcome,
    _sigterm_as_interrupt,
)
from drone_rl.sweeps import executors
from drone_rl.sweeps.manifest import Run, Sweep
from tests.cli.running import error_line

TRAINING = """
import json, pathlib, sys
arguments = dict(a.split("=", 1) for a in sys.argv[2:])
folder = pathlib.Path(arguments["hydra.run.dir"].strip("'"))
with (folder / "starts").open("a") as file:
    file.write(f"{arguments['seed']} {arguments['optimizer.lr']}")
(folder / "result.json").write_text(json.dumps({"reason": "solved", "running_reward": 1.0}))
"""
"""A program instead of `drone-rl train` that notes its settings."""
GRID = ["train", "-m", "seed=0,1", "optimizer.lr=1e-3,1e-2", "hydra.sweep.dir=sweep"]


@pytest.fixture
def run(tmp_path):
    return Run(0, ("seed=1",), tmp_path)


def test_a_finished_run_returns_its_running_mean(run):
    result = {"reason": "frames", "running_reward": 1.5}
    (run.folder / "result.json").write_text(json.dumps(result))
    job = _job_return(run)
    assert (job.return_value, job.overrides) == (1.5, ["seed=1"])
    assert _outcome(run) == "not solved in trainer.total_frames, running reward 1.500"
    (run.folder / "result.json").write_text(json.dumps({**result, "collapsed_at_frames": 12_345}))
    assert "(learning collapsed after 12,345 frames), running reward 1.500" in _outcome(run)
    result = {"reason": "solved", "running_reward": 2.98, "verdict": {"kind": "good"}}
    (run.folder / "result.json").write_text(json.dumps(result))
    assert _outcome(run) == "solved, running reward 2.980, verdict: good"


def test_a_failed_run_returns_nothing_and_logs_the_reason(run):
    assert _job_return(run).return_value is None
    assert _outcome(run) == "failed: reason unknown"
    (run.folder / "failure.json").write_text(json.dumps({"error": "no memory"}))
    assert _outcome(run) == "failed: no memory"


def test_the_command_is_what_was_typed(monkeypatch):
    argv = ["drone-rl train", "-m", "seed=0,1", "hydra.sweep.dir=${paths.outputs}/x"]
    monkeypatch.setattr(sys, "argv", argv)
    assert _command() == ["drone-rl", "train", "-m", "seed=0,1"]


def test_sigterm_stops_a_sweep_as_ctrl_c_does_with_its_own_status():
    before, seen = signal.getsignal(signal.SIGTERM), []
    with pytest.raises(SystemExit) as stop, _sigterm_as_interrupt():
        try:
            os.kill(os.getpid(), signal.SIGTERM)
            signal.sigtimedwait([], 1)
        except KeyboardInterrupt:
            seen.append("interrupt")
            raise
    assert (stop.value.code, seen) == (143, ["interrupt"])
    assert signal.getsignal(signal.SIGTERM) is before


def test_an_interrupted_sweep_logs_the_command_that_resumes_it(run, tmp_path, monkeypatch, caplog):
    class Interrupted:
        def finish(self, runs):
            raise KeyboardInterrupt

    launcher = SweepLauncher()
    launcher.executor = lambda folder: Interrupted()
    monkeypatch.setattr(
        "drone_rl.sweeps.report.write_sweep_report", lambda sweep: ("report.html", {})
    )
    caplog.set_level(logging.INFO)
    sweep = Sweep(tmp_path, "drone-rl train -m seed=0,1", {}, [run])
    with pytest.raises(KeyboardInterrupt):
        launcher._finish(sweep, [run])
    assert "resume with the same command: drone-rl train -m seed=0,1" in caplog.text


@pytest.mark.parametrize("subdir", ["seed${seed}_lr${optimizer.lr}", "lr${optimizer.lr}/${seed}"])
def test_each_run_is_in_the_folder_that_hydra_resolves(in_process, monkeypatch, tmp_path, subdir):
    monkeypatch.setattr(executors, "PROGRAM", (sys.executable, "-c", TRAINING))
    for _ in range(2):  # the same command finds the finished runs again
        done = in_process(*GRID, f"hydra.sweep.subdir={subdir}")
        assert done.returncode == 0, done.stderr
    settings = {
        subdir.replace("${seed}", seed).replace("${optimizer.lr}", lr): f"{seed} {lr}"
        for seed in ("0", "1")
        for lr in ("0.001", "0.01")
    }
    sweep = tmp_path / "sweep"
    starts = {str(p.parent.relative_to(sweep)): p.read_text() for p in sweep.rglob("starts")}
    assert starts == settings
    runs = json.loads((sweep / "sweep.json").read_text())["runs"]
    assert [run["folder"] for run in runs] == [*settings]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([*GRID, "hydra.sweep.subdir=${seed}"], "runs 0 and 1 have the same folder"),
        ([*GRID, "hydra.sweep.subdir=../${hydra.job.num}"], "'../0' is not inside"),
        ([*GRID, "seed=0,x"], "seed=0,x: it needs a whole number"),
        ([*GRID, "seed=range(0)"], "a sweep of no runs"),
    ],
)
def test_a_sweep_that_is_refused_writes_nothing(in_process, tmp_path, words, message):
    assert message in error_line(in_process(*words))
    assert [*tmp_path.iterdir()] == []
