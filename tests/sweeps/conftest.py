"""A sweep that was finished by hand, and a program that stands in for a training."""

import json
import sys

import pytest

from drone_rl.sweeps import Run, open_sweep, process
from drone_rl.utils.intervals import proportion

FAKE = """
import json, pathlib, sys, time
arguments = dict(a.split("=", 1) for a in sys.argv[2:])
folder = pathlib.Path(arguments["hydra.run.dir"].strip("'"))
with (folder / "starts").open("a") as file:
    file.write("resumed " if "resume" in arguments else "begun ")
(folder / "checkpoints").mkdir(exist_ok=True)
(folder / "checkpoints" / "last.pt").touch()
time.sleep(float(arguments.get("sleep", 0)))
if arguments.get("fail") == "true":
    sys.exit("error: fail=true is a mistake")
(folder / "result.json").write_text(json.dumps({"reason": "solved", "running_cubes": 1.0}))
"""


@pytest.fixture
def fake_training(monkeypatch):
    monkeypatch.setattr(process, "PROGRAM", (sys.executable, "-c", FAKE))


@pytest.fixture
def make_runs(tmp_path):
    """Runs with the given settings, nothing of them begun."""
    return lambda *overrides: [
        Run(i, tuple(o.split()), tmp_path / str(i)) for i, o in enumerate(overrides)
    ]


def _verdict(left=20, right=20, of=20, cubes=3.0):
    sides = {"left": left / of, "ahead": 1.0, "right": right / of}
    flown = {
        "episodes": 100,
        "mean_cubes": cubes,
        "success": proportion(100 if left == right == of else 0, 100),
        "shares": {side: {"mean": share} for side, share in sides.items()},
    }
    return {"kind": "good" if left == right else "one-sided (right)", "greedy": flown}


@pytest.fixture
def sweep(tmp_path, make_runs):
    """Two learning rates by two seeds: three finished, one failed."""
    rates = [
        f"optimiser.lr={lr} seed={seed} logger=csv" for lr in ("1e-3", "1e-1") for seed in "01"
    ]
    runs = make_runs(*rates)
    for run in runs:
        run.folder.mkdir()
        if run.number == 3:
            run.failure.write_text(json.dumps({"status": 2, "error": "<b>NaN</b>"}))
            continue
        figures = _verdict() if run.number < 2 else _verdict(left=0, cubes=1.5)
        result = {
            "reason": "solved" if run.number < 2 else "frames",
            "frames": 1000 * (run.number + 1),
            "episodes": 10,
            "seconds": 2.0,
            "running_cubes": 2.97 - run.number,
            "num_cubes": 3,
            "verdict": figures,
        }
        (run.folder / "result.json").write_text(json.dumps(result))
        rows = "update,frames,train/running_cubes,loss/entropy\n1,500,0.3,1.0\n2,1000,1.5,0.5\n"
        (run.folder / "metrics.csv").write_text(rows)
    return open_sweep(tmp_path, ["drone-rl", "train", "-m", "seed=0,1"], {"seed": 0}, runs)
