"""The machinery of `make mutants` that needs no Cosmic Ray."""

from pathlib import Path

import pytest

from tools.mutants import filters
from tools.mutants.targets import TARGETS, find_targets

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
        ("*", 4, True),  # the sign between parameters
        ("3", 4, False),  # ... but not its default
        ("1.5", 4, False),
        ("| str", 4, True),
        ("<", 5, False),  # whether it raises is behaviour
        ("+ 1", 6, True),  # what it says is not
        ("+ 2", 7, True),
        ("*", 8, False),
        ("*", 13, True),  # __repr__
    ],
)
def test_only_behaviour_is_mutated(text, line, silent):
    spans = filters.silent_spans(SOURCE)
    assert filters.is_within((line, column(text, line)), spans) is silent


@pytest.mark.parametrize(
    ("operator", "kept"),
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
def test_like_is_replaced_by_like(operator, kept):
    assert filters.is_of_one_kind(operator) is kept


def test_a_mutant_is_another_program():
    assert filters.changes_program("a = 1", "a = 2")
    assert not filters.changes_program("a = 1", "a  =  1")
    assert not filters.changes_program("a = 1", "a = = 1")
    assert not filters.changes_program("a = 1", None)


def test_each_target_is_there_and_has_tests_of_its_own_first():
    found = find_targets(ROOT)
    assert {f"drone_rl/{name}.py" for name in TARGETS if "*" not in name} <= set(found)
    assert all(tests for tests in found.values())
    assert (
        found["drone_rl/sim/tasks/collect_cubes/rules.py"][0]
        == "tests/sim/tasks/collect_cubes/test_rules.py"
    )
    assert "drone_rl/evaluation/metrics.py" in found
    assert "drone_rl/evaluation/video.py" not in found
    assert not any(name.endswith("__init__.py") for name in found)


def test_a_target_that_has_gone_or_has_no_tests_is_an_error(tmp_path):
    with pytest.raises(ValueError, match="no module is called sim/tasks/collect_cubes/rules"):
        find_targets(tmp_path)
    module = tmp_path / "drone_rl" / "sim" / "tasks" / "collect_cubes" / "rules.py"
    module.parent.mkdir(parents=True)
    module.write_text("")
    with pytest.raises(ValueError, match="none of its tests"):
        find_targets(tmp_path)
