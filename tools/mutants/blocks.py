"""Named code blocks of a module: its functions and the branches within them.

A block is the body of a function, branch, loop or exception handler. Unless an error occurs, it
runs as a whole or not at all. `instrument` adds to each block a call that reports its execution,
which shows the tests that can detect a mutation of the block.
"""

import ast
import dataclasses
from collections.abc import Iterator

from tools.mutants.filters import Position

CALLBACK = "__reached__"
"""Name of the built-in function that instrumented code calls with the name of a block."""
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
    """Whether Warp compiles the function. Such a block has no inner blocks and no report."""


def module_name(path: str) -> str:
    """Return the name of a module, given its path relative to the tree."""
    return path.removesuffix(".py").replace("/", ".").removesuffix(".__init__")


def blocks(tree: ast.Module, module: str) -> list[Block]:
    """Return all blocks of a module, outer blocks before inner ones."""
    return list(_blocks_below(tree, f"{module}:"))


def block_at(tree: ast.Module, module: str, position: Position) -> Block | None:
    """Return the innermost block at a position; None for code that runs at import."""
    found = [b for b in blocks(tree, module) if b.start <= position < b.end]
    return max(found, key=lambda block: block.start, default=None)


def instrument(source: str, module: str) -> ast.Module:
    """Return the syntax tree of a module in which each block reports its execution."""
    tree = ast.parse(source)
    for block in blocks(tree, module):
        if block.is_kernel:
            continue
        name = ast.Call(ast.Name(CALLBACK, ast.Load()), [ast.Constant(block.name)], [])
        first = block.statements[0]
        index = int(block.name.endswith("#0") and _is_docstring(first))
        report = ast.copy_location(ast.Expr(name), block.statements[-1 if index else 0])
        block.statements.insert(index, ast.fix_missing_locations(report))
    return tree


def _blocks_below(node: ast.AST, prefix: str) -> Iterator[Block]:
    """Yield the blocks of all functions below a node that is outside any function."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, Function):
            yield from _blocks_of(child, prefix)
        elif isinstance(child, ast.ClassDef):
            yield from _blocks_below(child, f"{prefix}{child.name}.")
        else:
            yield from _blocks_below(child, prefix)


def _blocks_of(function: Function, prefix: str) -> Iterator[Block]:
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
        yield from _blocks_of(node, f"{name}.")


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


def _is_docstring(node: ast.stmt) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
