"""Filters for mutations that change no behaviour by design or that only crash.

Excluded are
1. type annotations, and the markers `*` and `/` between parameters of a function;
2. the contents of `raise` statements and log messages (conditions around them are mutated);
3. bodies of `__repr__` and `__str__`;
4. replacements of an operator by one of another kind. `a << b` for `a + b` or `~x` for `-x` raises
   a TypeError for tensors and floats in any test, which would inflate the score. `is` for `==` is
   excluded too. Kinds: arithmetic, bitwise, order and equality, identity;
5. mutants that do not compile or that have the same syntax tree as the original.
"""

import ast
import functools
import re
from collections.abc import Iterator

Position = tuple[int, int]
"""Line (from 1) and column (from 0)."""

KINDS = (
    {"Add", "Sub", "Mul", "Div", "FloorDiv", "Mod", "Pow"},
    {"RShift", "LShift", "BitOr", "BitAnd", "BitXor"},
    {"Eq", "NotEq", "Lt", "LtE", "Gt", "GtE"},
    {"Is", "IsNot"},
    {"UAdd", "USub"},
    {"Invert"},
    {"Not"},
)
MARKER = re.compile(r"(?:^|[(,])\s*([*/])(?=\s*[,)])")
LOGS = re.compile(r"^(_log|log|logger|logging|warnings)\b")


def is_of_one_kind(operator: str) -> bool:
    """Return whether a Cosmic Ray operator keeps the kind of the token, or deletes it.

    Args:
        operator: Name of the operator, such as "core/ReplaceBinaryOperator_Add_Sub".
    """
    found = re.fullmatch(r"core/Replace\w+Operator_([A-Z]\w*?)_([A-Z]\w*)", operator)
    if found is None or found[1] == "Delete":
        return True
    return any(found[1] in kind and found[2] in kind for kind in KINDS)


def silent_spans(source: str) -> list[tuple[Position, Position]]:
    """Return start and end of the parts of a module without behaviour (rules 1 to 3)."""
    markers = (
        ((number, found.start(1)), (number, found.end(1)))
        for number, line in enumerate(source.splitlines(), 1)
        for found in MARKER.finditer(line)
    )
    return [*markers, *(_span(node) for node in _silent(ast.parse(source)))]


def is_within(position: Position, spans: list[tuple[Position, Position]]) -> bool:
    """Return whether a position lies in one of the spans."""
    return any(start <= position < end for start, end in spans)


def changes_program(source: str, mutated: str | None) -> bool:
    """Return whether mutated source compiles and differs from the original (rule 5)."""
    if mutated is None:
        return False
    try:
        changed = ast.dump(ast.parse(mutated))
        compile(mutated, "mutant", "exec")
    except SyntaxError:
        return False
    return changed != _dump(source)


@functools.cache
def _dump(source: str) -> str:
    return ast.dump(ast.parse(source))


def _silent(tree: ast.AST) -> Iterator[ast.AST]:
    for node in ast.walk(tree):
        if isinstance(node, ast.arg | ast.AnnAssign) and node.annotation is not None:
            yield node.annotation
        elif isinstance(node, ast.FunctionDef):
            if node.returns is not None:
                yield node.returns
            if node.name in ("__repr__", "__str__"):
                yield from node.body
        elif isinstance(node, ast.Raise) or (
            isinstance(node, ast.Call) and LOGS.match(ast.unparse(node.func))
        ):
            yield node


def _span(node: ast.AST) -> tuple[Position, Position]:
    return (node.lineno, node.col_offset), (node.end_lineno, node.end_col_offset)
