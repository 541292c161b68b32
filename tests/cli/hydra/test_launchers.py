"""Launchers of sweeps; whole sweeps are in tests/cli/test_sweeps."""

import json
import logging
import os
import shlex
import signal
import sys

import pytest

from drone_rl.cli.hydra.launchers import _sigterm_as_interrupt
from drone_rl.sweeps import executors
from tests.cli.running import error_line

TRAINING = """
import json, pathlib, sys
arguments = dict(a.split("=", 1) for a in sys.argv[2:])
folder = pathlib.Path(arguments["hydra.run.dir"].strip("'"))
with (folder / "starts").open("a") as file:
    file.write(f"{arguments['seed']} {arguments['optimizer.lr']}")
result = {"reason": "solved", "running_reward": 1.0, "largest_reward": 3}
(folder / "result.json").write_text(json.dumps(result))
"""
"""A program instead of `drone-rl train` that notes its settings."""
GRID = ["train", "-m", "seed=0,1", "optimizer.lr=1e-3,1e-2", "hydra.sweep.dir=sweep"]


def test_sigterm_interrupts_a_sweep():
    before, events = signal.getsignal(signal.SIGTERM), []
    with pytest.raises(SystemExit) as stop, _sigterm_as_interrupt():
        try:
            os.kill(os.getpid(), signal.SIGTERM)
            signal.sigtimedwait([], 1)
        except KeyboardInterrupt:
            events.append("interrupt")
            raise
    assert (stop.value.code, events) == (143, ["interrupt"])
    assert signal.getsignal(signal.SIGTERM) is before


def test_each_run_is_in_the_folder_that_hydra_resolves(in_process, monkeypatch, tmp_path):
    subdir = "lr${optimizer.lr}/${seed}"
    monkeypatch.setattr(executors, "PROGRAM", (sys.executable, "-c", TRAINING))
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
    manifest = json.loads((sweep / "sweep.json").read_text())
    assert [run["folder"] for run in manifest["runs"]] == [*settings]
    words = ["drone-rl", *GRID, f"hydra.sweep.subdir={subdir}"]
    assert manifest["command"] == shlex.join(words)


def test_an_interrupted_sweep_logs_the_command_that_resumes_it(in_process, monkeypatch, caplog):
    def interrupt(self, runs):
        raise KeyboardInterrupt

    monkeypatch.setattr(executors.LocalExecutor, "finish", interrupt)
    caplog.set_level(logging.INFO)
    assert in_process(*GRID).returncode == 130
    assert "resume with the same command: drone-rl train -m seed=0,1" in caplog.text


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([*GRID, "hydra.sweep.subdir=${seed}"], "runs 0 and 1 have the same folder"),
        ([*GRID, "hydra.sweep.subdir=../${hydra.job.num}"], "'../0' is not inside"),
        ([*GRID, "sed=0,1"], "has no setting sed"),
        (
            [*GRID, "optimizer.lr=0.1,-1"],
            "run 1 (seed=0 optimizer.lr=-1): optimizer.lr=-1: it must",
        ),
        ([*GRID, "seed=range(0)"], "a sweep of no runs"),
    ],
)
def test_a_sweep_that_is_refused_writes_nothing(in_process, tmp_path, words, message):
    assert message in error_line(in_process(*words))
    assert [*tmp_path.iterdir()] == []
