"""A sweep that was finished by hand, and a program that stands in for a training."""

import json
import sys

import pytest

from drone_rl.sweeps import executors
from drone_rl.sweeps.manifest import Run, open_sweep
from drone_rl.trust.rule import Rule
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
begin = time.monotonic()
while "until" in arguments and not (folder.parent / arguments["until"] / "starts").exists():
    time.sleep(0.01)
    if time.monotonic() - begin > 120:
        sys.exit("error: the other run never started")
if arguments.get("fail") == "true":
    sys.exit("error: fail=true is a mistake")
result = {"reason": "solved", "running_reward": 1.0, "largest_reward": 3}
(folder / "result.json").write_text(json.dumps(result))
"""


@pytest.fixture
def fake_training(monkeypatch):
    monkeypatch.setattr(executors, "PROGRAM", (sys.executable, "-c", FAKE))


@pytest.fixture
def make_runs(tmp_path):
    """Runs with the given settings, nothing of them begun."""
    return lambda *overrides: [
        Run(i, tuple(o.split()), tmp_path / str(i)) for i, o in enumerate(overrides)
    ]


@pytest.fixture
def make_verdict():
    """A verdict by the current rule; a share of None is of a side without goals."""
    return _verdict


def _verdict(kind="good", left=1.0, ahead=1.0, right=1.0, *, whole=1.0, certain=True, strata=None):
    sides = {"left": left, "ahead": ahead, "right": right}
    shares = {"all": whole, **(dict.fromkeys(strata, 1.0) if strata else sides)}
    greedy = {
        "episodes": 200,
        "success": dict(proportion(round(200 * whole), 200)),
        "shares": {
            name: {"mean": share, "lower95": 0.0, "upper95": 1.0, "count": 200}
            for name, share in shares.items()
        },
    }
    failures = {"rows": [], "largest": None, "bound": dict(proportion(0, 200))}
    about = {"exit_code": 0, "error_rate": 0.05, "good_share": 0.9, "baselines": {}}
    verdict = {"kind": kind, "certain": certain, "rule": Rule().text, "failures": failures}
    return {**about, **verdict, "greedy": greedy}


CURVE = (
    "update,frames,seconds,train/running_reward,loss/entropy\n1,500,1,0.3,1.0\n2,1000,2,1.5,0.5\n"
)


@pytest.fixture
def begin_sweep(tmp_path, make_runs):
    """A sweep of runs with the given settings, by what became of each.

    A dictionary is what its result.json has beside, or instead of, that of a solved run; a text the
    error with which it failed; None a run that has not ended.
    """

    def begin(outcomes):
        runs = make_runs(*outcomes)
        for run, outcome in zip(runs, outcomes.values(), strict=True):
            run.folder.mkdir()
            if outcome is not None:
                (run.folder / "metrics.csv").write_text(CURVE)
            if isinstance(outcome, str):
                run.failure.write_text(json.dumps({"error": outcome}))
            if isinstance(outcome, dict):
                (run.folder / "result.json").write_text(json.dumps({**SOLVED, **outcome}))
        return open_sweep(tmp_path, ["drone-rl", "train", "-m", "seed=0,1"], {"seed": 0}, runs)

    return begin


SOLVED = {
    "reason": "solved",
    "frames": 1000,
    "episodes": 10,
    "seconds": 2.0,
    "running_reward": 2.97,
    "largest_reward": 3,
}
LEFT_LOST = _verdict("one-sided (right)", left=0.0, whole=0.6, certain=False)


@pytest.fixture
def sweep(begin_sweep):
    """Two learning rates by two seeds: three finished, one failed."""
    return begin_sweep(
        {
            "optimizer.lr=1e-3 seed=0 logger=csv": {"verdict": _verdict()},
            "optimizer.lr=1e-3 seed=1 logger=csv": {"verdict": _verdict(), "frames": 2000},
            "optimizer.lr=1e-1 seed=0 logger=csv": {"verdict": LEFT_LOST, "reason": "frames"},
            "optimizer.lr=1e-1 seed=1 logger=csv": "<b>NaN</b>",
        }
    )
