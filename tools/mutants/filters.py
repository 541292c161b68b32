"""Which mutations are none: those that change no behaviour by design, and those that only crash.

Left out are
1. type annotations, and the signs `*` and `/` that part the parameters of a function;
2. `raise` statements and what is written to a log: their texts (whether the branch is taken at
   all is decided outside and stays in);
3. bodies of `__repr__` and `__str__`;
4. an operator replaced by one of another kind: `a + b` by `a << b` or `-x` by `~x` is a TypeError
   of tensors and floats, which any test notices, so that it would only flatter the figure; and
   `==` by `is`. Kinds: arithmetic, bits, order and equality, identity;
5. what does not compile, or compiles to the same syntax tree.
"""

import ast
import functools
import re
from collections.abc import Iterator

Position = tuple[int, int]
"""Line, counted from 1, and column, counted from 0."""

KINDS = (
    {"Add", "Sub", "Mul", "Div", "FloorDiv", "Mod", "Pow"},
    {"RShift", "LShift", "BitOr", "BitAnd", "BitXor"},
    {"Eq", "NotEq", "Lt", "LtE", "Gt", "GtE"},
    {"Is", "IsNot"},
    {"UAdd", "USub"},
    {"Invert"},
    {"Not"},
)
SIGN = re.compile(r"(?:^|[(,])\s*([*/])(?=\s*[,)])")
LOGS = re.compile(r"^(_log|log|logger|logging|warnings)\b")


def is_of_one_kind(operator: str) -> bool:
    """Whether an operator of Cosmic Ray replaces like by like, or deletes.

    Args:
        operator: Its name, such as "core/ReplaceBinaryOperator_Add_Sub".
    """
    found = re.fullmatch(r"core/Replace\w+Operator_([A-Z]\w*?)_([A-Z]\w*)", operator)
    if found is None or found[1] == "Delete":
        return True
    return any(found[1] in kind and found[2] in kind for kind in KINDS)


def silent_spans(source: str) -> list[tuple[Position, Position]]:
    """Parts of a module in which no behaviour is written (rules 1 to 3), from start to end."""
    signs = (
        ((number, found.start(1)), (number, found.end(1)))
        for number, line in enumerate(source.splitlines(), 1)
        for found in SIGN.finditer(line)
    )
    return [*signs, *(_span(node) for node in _silent(ast.parse(source)))]


def is_within(position: Position, spans: list[tuple[Position, Position]]) -> bool:
    """Whether a position lies in one of the spans."""
    return any(start <= position < end for start, end in spans)


def changes_program(source: str, mutated: str | None) -> bool:
    """Whether mutated source is a program, and another one (rule 5)."""
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
