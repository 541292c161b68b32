"""Targets, filters and results of `make mutants`."""

import json
from pathlib import Path

import pytest

pytest.importorskip("cosmic_ray", reason="pip install -e '.[mutants]'")

from tools.mutants import filters, results, targets

ROOT = Path(__file__).parents[2]
SOURCE = '''\
"""Doc."""


def root(x: int | None = 3, *, scale: float = 1.5) -> int | str:
    if x < 0:
        raise ValueError(f"{x + 1} is negative")
    _log.info("x is %d", x + 2)
    return x * 2


class Point:
    def __repr__(self):
        return "a" * 3
'''


def column(text, line):
    return SOURCE.splitlines()[line - 1].index(text)


@pytest.mark.parametrize(
    ("text", "line", "silent"),
    [
        ("|", 4, True),  # an annotation
        ("*", 4, True),  # the marker between parameters
        ("3", 4, False),  # a default
        ("1.5", 4, False),
        ("| str", 4, True),
        ("<", 5, False),  # the condition of a raise is behaviour
        ("+ 1", 6, True),  # its message is not
        ("+ 2", 7, True),
        ("*", 8, False),
        ("*", 13, True),  # __repr__
    ],
)
def test_spans_without_behaviour_are_silent(text, line, silent):
    spans = filters.silent_spans(SOURCE)
    assert filters.is_within((line, column(text, line)), spans) is silent


@pytest.mark.parametrize(
    ("operator", "is_kept"),
    [
        ("core/ReplaceBinaryOperator_Add_Sub", True),
        ("core/ReplaceBinaryOperator_Add_LShift", False),
        ("core/ReplaceBinaryOperator_BitAnd_BitOr", True),
        ("core/ReplaceComparisonOperator_Lt_LtE", True),
        ("core/ReplaceComparisonOperator_Eq_Is", False),
        ("core/ReplaceComparisonOperator_Is_IsNot", True),
        ("core/ReplaceUnaryOperator_USub_Invert", False),
        ("core/ReplaceUnaryOperator_Delete_Not", True),
        ("core/NumberReplacer", True),
        ("drone_rl/SwapName", True),
    ],
)
def test_an_operator_must_keep_the_kind_of_a_token(operator, is_kept):
    assert filters.is_of_one_kind(operator) is is_kept


def test_a_mutant_must_compile_and_differ():
    assert filters.changes_program("a = 1", "a = 2")
    assert not filters.changes_program("a = 1", "a  =  1")
    assert not filters.changes_program("a = 1", "a = = 1")
    assert not filters.changes_program("a = 1", None)


def test_the_whole_package_is_mutated():
    found = targets.modules(ROOT)
    assert "drone_rl/evaluation/metrics.py" in found
    assert "drone_rl/acceleration/gradients_kernel.py" in found
    packages = {path.parent.name for path in (ROOT / "drone_rl").glob("*/__init__.py")}
    assert {name.split("/")[1] for name in found if name.count("/") > 1} == packages


def test_tests_of_pages_and_tools_are_excluded():
    found = targets.test_files(ROOT)
    assert "tests/evaluation/test_metrics.py" in found
    assert "tests/benchmarks/test_sentences.py" in found  # changes every sentence
    assert not any("/tools/" in name or "/docs/" in name for name in found)


def test_mirror_returns_the_test_file_of_a_module():
    assert targets.mirror("drone_rl/sim/tasks/task.py") == "tests/sim/tasks/test_task.py"
    assert targets.mirror("drone_rl/sim/__init__.py") == "tests/sim/test_sim.py"
    assert targets.mirror("drone_rl/__init__.py") == "tests/test_drone_rl.py"


def test_a_tree_without_modules_raises(tmp_path):
    with pytest.raises(ValueError, match="has no modules"):
        targets.modules(tmp_path)


def test_each_listed_survivor_has_a_harm():
    content = json.loads((ROOT / "docs" / "mutants.json").read_text())
    survivors = [row for row in content["mutants"] if row["outcome"] == "survived"]
    if not any("harm" in row for row in survivors):
        pytest.skip("the list predates harms")
    assert [row["id"] for row in survivors if not row["harm"]] == []


def test_killers_are_read_from_lists_and_mappings(tmp_path):
    rows = [{"id": "a", "by": "x::y"}, {"id": "b"}, {"id": "c", "by": "old"}]
    (tmp_path / "list.json").write_text(json.dumps({"mutants": rows}))
    (tmp_path / "memory.json").write_text(json.dumps({"c": "new"}))
    paths = [tmp_path / name for name in ("list.json", "memory.json", "missing.json")]
    assert results.read_killers(*paths) == {"a": "x::y", "c": "new"}
