"""Blocks of a small module, and which of them report that they ran."""

import ast
import builtins

import pytest

from tools.mutants.blocks import CALLED, block_at, counted, module_name

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

    def told():
        return mark

    for _ in range(x):
        mark = mark.upper()
    return told()


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


def place(text):
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
        ("return mark", "m:grade.told#0"),
        ("mark.upper", "m:grade#"),
        ("told()\n", "m:grade#0"),
        ("size = 2", None),
        ("self.size", "m:Box.twice#0"),
        ("return 0\n", "m:Box.twice#1"),
        ("> 1.0", "m:kernel#0"),
        ("return x", "m:kernel#0"),  # a branch of a kernel reports nothing
    ],
)
def test_the_innermost_block_is_found(text, name):
    block = block_at(ast.parse(SOURCE), "m", place(text.strip()))
    if name is None:
        assert block is None
    else:
        assert block.name.startswith(name) and block.is_kernel is ("kernel" in name)


def test_blocks_have_names_of_their_own():
    texts = ("> best", '"good"', "> 1:", '"fair"', '"poor"', "mark.upper")
    names = [block_at(ast.parse(SOURCE), "m", place(text)).name for text in texts]
    assert len(set(names)) == len(names)


def test_what_runs_reports_and_works_as_before(monkeypatch):
    ran = []
    monkeypatch.setattr(builtins, CALLED, ran.append, raising=False)
    scope = {"wp": type("wp", (), {"func": staticmethod(lambda function: function)})}
    exec(compile(counted(SOURCE, "m"), "m.py", "exec"), scope)
    assert not ran
    assert scope["grade"].__doc__ == "Doc."
    assert scope["grade"](0) == "poor"
    at = [block_at(ast.parse(SOURCE), "m", place(t)).name for t in ("> best", "> 1:", '"poor"')]
    assert ran == [*at, "m:grade.told#0"]
    ran.clear()
    assert scope["Box"]().twice == 4
    assert ran == ["m:Box.twice#0"]
    ran.clear()
    assert scope["kernel"](2.0) == 2.0
    assert not ran


def test_names_of_modules():
    assert module_name("drone_rl/sim/actions.py") == "drone_rl.sim.actions"
    assert module_name("drone_rl/sim/__init__.py") == "drone_rl.sim"
