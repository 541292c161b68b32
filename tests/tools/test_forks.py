"""Runs of a program with one module: its tests and mutants of it."""

from tools.mutants.forks import Run, run_all

MODULE = "def double(x):\n    return 2 * x\n"
TESTS = "from small.module import double\n\n\ndef test_double():\n    assert double(3) == 6\n"
MUTANTS = {
    "same": (None, "", 60.0),
    "detected": ("small/module.py", MODULE.replace("2", "3"), 60.0),
    "undetected": ("small/module.py", MODULE.replace("2 * x", "x + 3"), 60.0),
    "crash": ("small/module.py", MODULE.replace("return", "import os; os.abort(); return"), 60.0),
    "endless": ("small/module.py", MODULE.replace("return 2", "while True: 2"), 3.0),
}


def test_mutants_run_in_memory_and_leave_the_file_unchanged(tmp_path):
    tree, scratch = tmp_path / "tree", tmp_path / "scratch"
    (tree / "small").mkdir(parents=True)
    scratch.mkdir()
    module = tree / "small" / "module.py"
    module.write_text(MODULE)
    (tree / "test_module.py").write_text(TESTS)
    runs = (Run(name, ["test_module.py"], s, m, text) for name, (m, text, s) in MUTANTS.items())
    found = {o.run.name: o.status for o in run_all(runs, tree, scratch, jobs=2)}
    assert found == {
        "same": "passed",
        "detected": "failed",
        "undetected": "passed",
        "crash": "failed",
        "endless": "timeout",
    }
    assert module.read_text() == MODULE


def test_a_run_without_tests_fails(tmp_path):
    (tmp_path / "test_nothing.py").write_text("")
    (outcome,) = run_all(iter([Run("a", ["test_nothing.py"], 60.0)]), tmp_path, tmp_path, jobs=1)
    assert outcome.status == "failed"


def test_inspect_returns_the_mutated_source(tmp_path):
    """Warp compiles the source that inspect returns."""
    (tmp_path / "module.py").write_text(MODULE)
    (tmp_path / "test_source.py").write_text(
        "import inspect\n\nfrom module import double\n\n\n"
        "def test_source():\n    assert '2 * x' in inspect.getsource(double)\n"
    )
    source = MODULE.replace("2", "3")
    runs = [Run("same", ["test_source.py"], 60.0)]
    runs += [Run("mutant", ["test_source.py"], 60.0, "module.py", source)]
    found = {o.run.name: o.status for o in run_all(iter(runs), tmp_path, tmp_path, jobs=1)}
    assert found == {"same": "passed", "mutant": "failed"}


def test_the_second_stage_runs_if_the_first_passes(tmp_path):
    (tmp_path / "test_first.py").write_text("def test_first():\n    assert True\n")
    (tmp_path / "test_second.py").write_text("def test_second():\n    assert 1 == 2\n")
    first, second = ["test_first.py"], ["test_second.py"]
    runs = [Run("both", first, 60.0, then=second), Run("others", [], 60.0, then=second)]
    runs += [Run("unskipped", first, 60.0, then=[*first, *second], skip=["test_second.py::x"])]
    runs += [
        Run("skipped", first, 60.0, then=[*first, *second], skip=[f"{second[0]}::test_second"])
    ]
    found = {o.run.name: o for o in run_all(iter(runs), tmp_path, tmp_path, jobs=1)}
    assert found["both"].status == found["others"].status == found["unskipped"].status == "failed"
    assert found["both"].failing == "test_second.py::test_second"
    assert found["skipped"].status == "passed" and found["skipped"].failing is None


def test_the_first_stage_runs_before_the_others(tmp_path):
    for name, assertion in {"known": "1 == 2", "own": "1 == 3"}.items():
        (tmp_path / f"test_{name}.py").write_text(f"def test():\n    assert {assertion}\n")
    runs = [Run("a", ["test_own.py"], 60.0, first=["test_known.py"])]
    (outcome,) = run_all(iter(runs), tmp_path, tmp_path, jobs=1)
    assert outcome.failing == "test_known.py::test"
