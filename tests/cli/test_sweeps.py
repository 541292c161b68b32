"""A sweep that is killed and resumed, with one run that fails."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest
import torch

from drone_rl.utils.checkpoint import load_checkpoint
from tests.cli.running import run_main

pytestmark = pytest.mark.slow

TINY = ["experiment=smoke", "logger=csv", "collector.num_envs=4", "trainer.total_frames=1200"]
ONE_BY_ONE = "hydra.launcher.num_jobs=1"
SWEEP = [
    "train",
    "-m",
    *TINY,
    "seed=0",
    "demonstrations=null,absent",
    "evaluate_after=10",
    ONE_BY_ONE,
]
FOLDER = "outputs/train/multiruns"


def kill_everything_of(folder):
    """Kills -9, as a power cut would, what works under a folder."""
    listed = subprocess.run(["pgrep", "-f", str(folder)], capture_output=True, text=True).stdout
    for pid in listed.split():
        os.kill(int(pid), signal.SIGKILL)


@pytest.fixture(scope="module")
def sweep(tmp_path_factory):
    """Killed when its first run is half-way, then given again."""
    folder = tmp_path_factory.mktemp("killed")
    command = [sys.executable, "-m", "drone_rl.cli.main", *SWEEP]
    process = subprocess.Popen(command, cwd=folder, stderr=subprocess.DEVNULL)
    while not any(
        len(metrics.read_text().splitlines()) > 3 for metrics in folder.rglob("metrics.csv")
    ):
        assert process.poll() is None
        time.sleep(0.02)
    process.kill()
    process.wait()
    kill_everything_of(folder)
    assert not list(folder.rglob("result.json"))
    assert run_main(folder, *SWEEP) == 1  # one of the runs is a mistake
    (found,) = (folder / FOLDER).iterdir()
    return found


def test_a_killed_sweep_ends_like_an_uninterrupted_one(sweep, in_process, tmp_path):
    (run,) = sweep.glob("0_*")
    done = in_process("train", *TINY, "seed=0", "hydra.run.dir=alone")
    assert done.returncode == 0, done.stderr
    one, two = (
        load_checkpoint(folder / "checkpoints" / "last.pt") for folder in (run, tmp_path / "alone")
    )
    assert all(torch.equal(one["policy"][k], two["policy"][k]) for k in one["policy"])
    assert one["progress"]["running_reward"] == two["progress"]["running_reward"]
    assert len((run / "metrics.csv").read_text().splitlines()) == len(
        (tmp_path / "alone" / "metrics.csv").read_text().splitlines()
    )


def test_a_failed_run_is_in_the_summary(sweep):
    summary = json.loads((sweep / "summary.json").read_text())
    assert [run["state"] for run in summary["runs"]] == ["finished", "failed"]
    assert "absent" in summary["runs"][1]["error"]
    assert summary["runs"][0]["verdict"] is not None
    assert "absent" in (sweep / "report.html").read_text()


def test_one_run_of_a_sweep_can_be_resumed(sweep, in_process):
    (run,) = sweep.glob("0_*")
    in_process("train", f"resume={run}", "trainer.total_frames=1600", cwd=sweep)
    assert json.loads((run / "result.json").read_text())["frames"] >= 1600
