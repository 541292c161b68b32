"""Blocks of a module: its functions, and the branches within them, each with a name.

A block runs as a whole or not at all, but for errors: the body of a function, or of a branch,
a loop or a handler in it. `counted` makes every block report when it runs, which says which
tests can notice a mutation of it.
"""

import ast
import dataclasses
from collections.abc import Iterator

from tools.mutants.filters import Position

CALLED = "__reached__"
"""A built-in function that takes the name of a block; whoever runs counted code provides it."""
WARP = ("wp.kernel", "wp.func", "wp.func_native", "warp.kernel", "warp.func", "warp.func_native")
Function = ast.FunctionDef | ast.AsyncFunctionDef


@dataclasses.dataclass(frozen=True)
class Block:
    """A part of a function."""

    name: str
    """Such as "drone_rl.sim.actions:Parts.split#2"; "#0" is the function itself."""
    start: Position
    end: Position
    statements: list[ast.stmt]
    is_kernel: bool
    """Whether Warp compiles it, so that it has no branches of its own and reports nothing."""


def module_name(path: str) -> str:
    """The name of a module, from its path below the tree."""
    return path.removesuffix(".py").replace("/", ".").removesuffix(".__init__")


def blocks(tree: ast.Module, module: str) -> list[Block]:
    """All blocks of a module, outer ones before those in them."""
    return list(_inside(tree, f"{module}:"))


def block_at(tree: ast.Module, module: str, position: Position) -> Block | None:
    """The innermost block at a position; None for what runs when the module is imported."""
    found = [b for b in blocks(tree, module) if b.start <= position < b.end]
    return max(found, key=lambda block: block.start, default=None)


def counted(source: str, module: str) -> ast.Module:
    """The syntax tree of a module whose blocks report that they run."""
    tree = ast.parse(source)
    for block in blocks(tree, module):
        if block.is_kernel:
            continue
        name = ast.Call(ast.Name(CALLED, ast.Load()), [ast.Constant(block.name)], [])
        first = block.statements[0]
        place = int(block.name.endswith("#0") and _is_text(first))
        report = ast.copy_location(ast.Expr(name), block.statements[-1 if place else 0])
        block.statements.insert(place, ast.fix_missing_locations(report))
    return tree


def _inside(node: ast.AST, prefix: str) -> Iterator[Block]:
    """Blocks of the functions below a node that is in no function."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, Function):
            yield from _of(child, prefix)
        elif isinstance(child, ast.ClassDef):
            yield from _inside(child, f"{prefix}{child.name}.")
        else:
            yield from _inside(child, prefix)


def _of(function: Function, prefix: str) -> Iterator[Block]:
    name = f"{prefix}{function.name}"
    is_kernel = any(_decorator(d) in WARP for d in function.decorator_list)
    yield _block(f"{name}#0", function.body, is_kernel)
    if is_kernel:
        return
    branches, inner = [], []
    todo = list(function.body)
    while todo:
        node = todo.pop(0)
        if isinstance(node, Function):
            inner.append(node)
            continue
        branches += _branches(node)
        todo += ast.iter_child_nodes(node)
    for count, body in enumerate(branches, 1):
        yield _block(f"{name}#{count}", body, False)
    for node in inner:
        yield from _of(node, f"{name}.")


def _branches(node: ast.AST) -> Iterator[list[ast.stmt]]:
    if isinstance(node, ast.If | ast.For | ast.While):
        yield node.body
        if node.orelse:
            yield node.orelse
    elif isinstance(node, ast.ExceptHandler | ast.match_case):
        yield node.body


def _block(name: str, body: list[ast.stmt], is_kernel: bool) -> Block:
    start, end = body[0], body[-1]
    last = (end.end_lineno or end.lineno, end.end_col_offset or end.col_offset)
    return Block(name, (start.lineno, start.col_offset), last, body, is_kernel)


def _decorator(node: ast.expr) -> str:
    return ast.unparse(node.func if isinstance(node, ast.Call) else node)


def _is_text(node: ast.stmt) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
