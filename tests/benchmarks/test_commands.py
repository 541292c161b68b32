"""Commands in separate processes: exit status, duration, memory."""

import os
import sys

import pytest

from benchmarks import commands
from benchmarks.commands import call, memory_status, train, watch


def python(code):
    return (sys.executable, "-c", code)


def test_a_command_gets_its_arguments_and_additional_environment_variables(tmp_path):
    code = "import os, sys; open(sys.argv[1], 'w').write(os.environ['TIDE'] + os.environ['PATH'])"
    call(str(tmp_path / "x"), program=python(code), environment={"TIDE": "low "})
    assert (tmp_path / "x").read_text() == f"low {os.environ['PATH']}"


def test_an_unexpected_status_is_an_error_with_the_end_of_stderr():
    program = python("import sys; sys.stderr.write('x' * 999 + 'too late'); sys.exit(11)")
    call("verdict", program=program, statuses=(0, 11))
    with pytest.raises(RuntimeError, match=r"drone-rl verdict failed: x+too late$") as error:
        call("verdict", program=program)
    assert len(str(error.value)) < 600


def test_watch_returns_time_and_peak_memory(monkeypatch):
    code = "import time; kept = bytearray(80 * 2**20); del kept; time.sleep(0.4)"
    monkeypatch.setattr(commands, "PROGRAM", python(code))
    seconds, peak = watch()
    assert 0.4 < seconds < 20
    assert 80 < peak < 200
    monkeypatch.setattr(commands, "PROGRAM", python("raise SystemExit(3)"))
    with pytest.raises(RuntimeError, match="drone-rl explain failed: status 3"):
        watch("explain")


def test_train_returns_its_time_and_the_result_file(monkeypatch, tmp_path):
    code = """
import json, os, sys, time
assert sys.argv[1:3] == ["train", "seed=3"], sys.argv
run = sys.argv[3].removeprefix("hydra.run.dir=")
os.mkdir(run)
time.sleep(0.3)
json.dump({"frames": 7}, open(run + "/result.json", "w"))
"""

    def run_it(*args):
        call(*args, program=python(code))

    monkeypatch.setattr(commands, "call", run_it)
    seconds, result = train(tmp_path / "run", "seed=3")
    assert result == {"frames": 7}
    assert 0.3 < seconds < 20


def test_memory_status_of_a_process():
    status = memory_status(os.getpid())
    assert status["VmHWM"] >= status["VmRSS"] > 10
    assert memory_status(2**22 + 1) == {}
