"""Benchmarks are found, run one after the other, and their figures stored with their origin."""

import json
import re

import pytest

from benchmarks.benchmark import Benchmark
from benchmarks.ledger import Ledger, describe_machine, digest_code, make_origin
from benchmarks.registry import BENCHMARKS, GROUPS, find_benchmarks
from benchmarks.run import run_benchmarks
from drone_rl.cli.main import find_command
from drone_rl.utils.errors import InputError


@pytest.mark.parametrize("name", BENCHMARKS)
def test_a_benchmark_measures_code_that_exists_and_has_help(name):
    benchmark = BENCHMARKS[name]
    assert callable(benchmark.run) and digest_code(benchmark.measures)
    text = find_command("bench").description()
    assert re.search(rf"\b{name}\b", text) and re.search(rf"\b{benchmark.group}\b", text)


def test_groups_are_expanded_and_duplicates_removed():
    group = [name for name, benchmark in BENCHMARKS.items() if benchmark.group == "adversarial"]
    others = [name for name in group if name != "gamed"]
    assert find_benchmarks(["gamed", "adversarial"]) == ["gamed", *others]
    assert not set(GROUPS) & set(BENCHMARKS)
    with pytest.raises(InputError, match="'speeed' is unknown"):
        find_benchmarks(["render", "speeed"])


@pytest.fixture
def bench(setup):
    """Run the benchmarks `one`, `broken` and `two`; return those that ran, and the failures."""

    def command(names=("one", "broken", "two"), again=False, error=InputError):
        ran = []

        def make_benchmark(name):
            def measure(setup):
                ran.append(name)
                if name == "broken":
                    raise error("out of order")
                return {f"{name}_s": len(ran)}

            return Benchmark(measure, "tests", ("benchmarks/run",))

        benchmarks = {name: make_benchmark(name) for name in ("one", "broken", "two")}
        ledger = Ledger(setup.folder / "results.json")
        return ran, run_benchmarks(names, setup, ledger, again=again, benchmarks=benchmarks)

    return command


def test_a_failure_does_not_stop_other_benchmarks(bench, setup):
    assert bench() == (["one", "broken", "two"], {"broken": "out of order"})
    content = json.loads((setup.folder / "results.json").read_text())
    assert (content["one_s"], content["two_s"]) == (1, 3)
    assert content["benchmarks"].keys() == {"one", "two"}


def test_a_second_command_continues_after_an_interrupt(bench):
    with pytest.raises(KeyboardInterrupt):
        bench(error=KeyboardInterrupt)
    assert bench()[0] == ["broken", "two"]
    assert bench(["one"], again=True)[0] == ["one"]


def store(path, name="tides", **figures):
    ledger = Ledger(path)
    ledger.add(name, figures, make_origin("abc", {"quick": True}))
    return Ledger(path)


def test_a_benchmark_replaces_only_its_own_figures(tmp_path, monkeypatch):
    store(tmp_path / "r.json", old=1, kept=1)
    store(tmp_path / "r.json", "moon", phase=2)
    ledger = store(tmp_path / "r.json", kept=3)
    assert ledger.figures == {"phase": 2, "kept": 3}
    origin = json.loads((tmp_path / "r.json").read_text())["benchmarks"]["tides"]
    assert (origin["keys"], origin["machine"]) == (["kept"], describe_machine())
    assert ledger.is_current("tides", "abc", {"quick": True})
    assert not ledger.is_current("tides", "abd", {"quick": True})
    assert not ledger.is_current("tides", "abc", {"quick": False})
    monkeypatch.setattr("benchmarks.ledger.num_cores", lambda: 1234)
    assert not ledger.is_current("tides", "abc", {"quick": True})


def test_a_file_of_another_kind_is_an_error(tmp_path):
    (tmp_path / "r.json").write_text('{"benchmarks": {"a": {}}}')
    with pytest.raises(InputError, match="not a benchmark results file"):
        Ledger(tmp_path / "r.json")


@pytest.mark.parametrize(
    ("path", "counts"),
    [
        ("drone_rl/sim/deep/b.py", True),
        ("conf/train.yaml", True),
        ("benchmarks/c.py", False),
        ("drone_rl/sim/notes.md", False),
    ],
)
def test_the_digest_depends_on_the_measured_code_only(tmp_path, path, counts):
    for name in ("drone_rl/sim/deep/b.py", "benchmarks/c.py", "conf/train.yaml"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("1")
    before = digest_code(["sim", "conf"], tmp_path)
    (tmp_path / path).write_text("2")
    assert (digest_code(["sim", "conf"], tmp_path) != before) is counts
