import json
import os

import pytest

from benchmarks.benchmark import Benchmark, Setup
from benchmarks.ledger import Ledger
from benchmarks.run import run_benchmarks
from drone_rl.utils.errors import InputError


@pytest.fixture
def bench(tmp_path):
    """Run the benchmarks `one`, `broken` and `two`; return those that ran, and the failures."""

    def command(names=("one", "broken", "two"), again=False, broken=InputError, **changes):
        ran = []

        def make_benchmark(name):
            def measure(setup):
                ran.append(name)
                if name == "broken":
                    raise broken("out of order")
                return {f"{name}_s": len(ran)}

            return Benchmark(measure, "tests", ("benchmarks/run",))

        given = {"folder": tmp_path, "quick": False, "device": "cpu", "num_envs": 2, "seeds": (0,)}
        setup = Setup(**given | {"episodes": 1, "memory_frames": 1} | changes)
        benchmarks = {name: make_benchmark(name) for name in ("one", "broken", "two")}
        ledger = Ledger(tmp_path / "results.json")
        failures = run_benchmarks(names, setup, ledger, again=again, benchmarks=benchmarks)
        return ran, failures

    return command


def test_a_failure_does_not_stop_other_benchmarks(bench, tmp_path):
    assert bench() == (["one", "broken", "two"], {"broken": "out of order"})
    content = json.loads((tmp_path / "results.json").read_text())
    assert (content["one_s"], content["two_s"]) == (1, 3)
    assert content["benchmarks"].keys() == {"one", "two"}


def test_a_second_command_continues_after_an_interrupt(bench, tmp_path):
    with pytest.raises(KeyboardInterrupt):
        bench(broken=KeyboardInterrupt)
    assert "one_s" in json.loads((tmp_path / "results.json").read_text())
    assert bench()[0] == ["broken", "two"]
    assert bench()[0] == ["broken"]


def test_again_and_new_settings_repeat_a_benchmark(bench):
    bench()
    assert bench(["one"], again=True)[0] == ["one"]
    assert bench(["one"], seeds=(1,))[0] == ["one"]
    assert bench(["one"], seeds=(1,))[0] == []


def test_runs_of_an_earlier_command_are_deleted_but_not_its_log(bench, tmp_path):
    log = tmp_path / "runs" / "2026-01-01" / "bench.log"
    log.parent.mkdir(parents=True)
    log.touch()
    (tmp_path / "work" / "train_0").mkdir(parents=True)
    bench([])
    assert not (tmp_path / "work").exists()
    assert log.exists()


def test_measured_programs_may_keep_compiled_files(bench, monkeypatch):
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")
    bench()
    assert "PYTHONDONTWRITEBYTECODE" not in os.environ
