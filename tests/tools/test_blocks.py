"""Blocks of a small module, and the blocks that report their execution."""

import ast
import builtins

import pytest

from tools.mutants.blocks import CALLBACK, block_at, instrument, module_name

SOURCE = '''\
LIMIT = 3


def grade(x, best=LIMIT + 1):
    """Doc."""
    if x > best:
        return "good"
    elif x > 1:
        mark = "fair"
    else:
        mark = "poor"

    def get_mark():
        return mark

    for _ in range(x):
        mark = mark.upper()
    return get_mark()


class Box:
    size = 2

    @property
    def twice(self):
        try:
            return self.size * 2
        except TypeError:
            return 0


@wp.func
def kernel(x: float):
    if x > 1.0:
        return x
    return 0.0
'''


def position_of(text):
    lines = SOURCE.splitlines()
    number = next(index for index, line in enumerate(lines) if text in line)
    return number + 1, lines[number].index(text)


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("3", None),
        ("1):", None),  # a default
        ("> best", "m:grade#0"),
        ('"good"', "m:grade#1"),
        ('"fair"', "m:grade#"),
        ('"poor"', "m:grade#"),
        ("return mark", "m:grade.get_mark#0"),
        ("mark.upper", "m:grade#"),
        ("get_mark()\n", "m:grade#0"),
        ("size = 2", None),
        ("self.size", "m:Box.twice#0"),
        ("return 0\n", "m:Box.twice#1"),
        ("> 1.0", "m:kernel#0"),
        ("return x", "m:kernel#0"),  # a branch belongs to the block of its kernel
    ],
)
def test_block_at_returns_the_innermost_block(text, name):
    block = block_at(ast.parse(SOURCE), "m", position_of(text.strip()))
    if name is None:
        assert block is None
    else:
        assert block.name.startswith(name) and block.is_kernel is ("kernel" in name)


def test_block_names_are_unique():
    texts = ("> best", '"good"', "> 1:", '"fair"', '"poor"', "mark.upper")
    names = [block_at(ast.parse(SOURCE), "m", position_of(text)).name for text in texts]
    assert len(set(names)) == len(names)


def test_instrumented_code_reports_blocks_and_works_as_before(monkeypatch):
    ran = []
    monkeypatch.setattr(builtins, CALLBACK, ran.append, raising=False)
    scope = {"wp": type("wp", (), {"func": staticmethod(lambda function: function)})}
    exec(compile(instrument(SOURCE, "m"), "m.py", "exec"), scope)
    assert not ran
    assert scope["grade"].__doc__ == "Doc."
    assert scope["grade"](0) == "poor"
    at = [
        block_at(ast.parse(SOURCE), "m", position_of(t)).name for t in ("> best", "> 1:", '"poor"')
    ]
    assert ran == [*at, "m:grade.get_mark#0"]
    ran.clear()
    assert scope["Box"]().twice == 4
    assert ran == ["m:Box.twice#0"]
    ran.clear()
    assert scope["kernel"](2.0) == 2.0
    assert not ran


def test_module_name_follows_from_the_path():
    assert module_name("drone_rl/sim/actions.py") == "drone_rl.sim.actions"
    assert module_name("drone_rl/sim/__init__.py") == "drone_rl.sim"
