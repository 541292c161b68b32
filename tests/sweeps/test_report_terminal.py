"""Which sweep is meant, and its sentences on a terminal."""

import os
import subprocess
import sys

import pytest

from drone_rl.sweeps.manifest import Run, Sweep
from drone_rl.sweeps.report import find_sweep, terminal_lines
from drone_rl.utils.errors import InputError


def begun(folder):
    folder.mkdir(parents=True)
    Sweep(folder, "drone-rl train -m seed=0", {}, [Run(0, ("seed=0",), folder / "0")]).save()
    return folder


def test_the_latest_is_the_newest(tmp_path):
    sweeps = [begun(tmp_path / "train" / "multiruns" / name) for name in ("b", "a")]
    for number, sweep in enumerate(sweeps):
        os.utime(sweep / "sweep.json", (number, number))
    assert find_sweep("latest", tmp_path).folder == sweeps[1]
    assert find_sweep(sweeps[0]).folder == sweeps[0]


def test_there_is_none(tmp_path):
    with pytest.raises(InputError, match="drone-rl train -m first"):
        find_sweep("latest", tmp_path)


def test_the_sentences_in_order():
    figures = {
        "sentences": {
            "runs.all": "3 runs.",
            "best.run": "Run 2.",
            "x.y": "no",
            "verdicts.a": "All.",
        },
        "groups": [{"lr": "0.1", "runs": 3, "sentences": {"a": "one", "b": "two"}}],
        "runs": [{"run": 1, "state": "failed", "error": "no memory"}, {"run": 2, "error": None}],
        "best": {"command": "drone-rl train seed=2"},
    }
    lines = terminal_lines(figures).splitlines()
    assert lines[:2] == ["3 runs.", "All."]
    assert lines[2].split(maxsplit=1) == ["lr=0.1", "one; two"]
    assert lines[3:] == [
        *("run 1 failed: no memory", "best run: Run 2."),
        "to repeat it: drone-rl train seed=2",
    ]


def test_a_report_needs_no_torch():
    code = "import sys, drone_rl.sweeps.report; assert 'torch' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
