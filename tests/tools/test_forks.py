"""A program of one module, its tests, and three mutants of it."""

from tools.mutants.forks import Run, run_all

MODULE = "def double(x):\n    return 2 * x\n"
TESTS = "from small.module import double\n\n\ndef test_double():\n    assert double(3) == 6\n"
MUTANTS = {
    "same": (None, "", 60.0),
    "noticed": ("small/module.py", MODULE.replace("2", "3"), 60.0),
    "unnoticed": ("small/module.py", MODULE.replace("2 * x", "x + 3"), 60.0),
    "crash": ("small/module.py", MODULE.replace("return", "import os; os.abort(); return"), 60.0),
    "endless": ("small/module.py", MODULE.replace("return 2", "while True: 2"), 3.0),
}


def test_a_mutation_is_seen_by_the_tests_and_leaves_the_file_alone(tmp_path):
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
        "noticed": "failed",
        "unnoticed": "passed",
        "crash": "failed",
        "endless": "timeout",
    }
    assert module.read_text() == MODULE


def test_no_tests_are_no_survival(tmp_path):
    (tmp_path / "test_nothing.py").write_text("")
    (outcome,) = run_all(iter([Run("a", ["test_nothing.py"], 60.0)]), tmp_path, tmp_path, jobs=1)
    assert outcome.status == "failed"
