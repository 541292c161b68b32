"""Run the blocks of one page in the current folder: `python -m tools.docs.session PAGE [FLAGS]`."""

import ast
import contextlib
import dataclasses
import io
import os
import re
import subprocess
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from tools.docs.blocks import COMMAND, PYTHON, Block, read_blocks
from tools.docs.outputs import OMITTED, find_difference, find_different_words
from tools.docs.rules import Rules, read_rules

LIMIT = 900.0
"""Seconds after which a command is killed."""
RAN, SMALLER, NOT_RUN, FAILED = "ran", "ran with smaller sizes", "not run", "failed"
OTHER_NUMBERS = "printed other numbers"
"""Status of a block that prints the page's words with other numbers, after the page has trained: a
policy trained with the same seed depends on how the processor rounds."""
_TRAINS = re.compile(r"drone-rl (train|demo)|Trainer\(|\btrain\(")


@dataclasses.dataclass(frozen=True)
class Outcome:
    """Result of a block."""

    block: Block
    status: str
    """One of `RAN`, `SMALLER`, `OTHER_NUMBERS`, `NOT_RUN` and `FAILED`."""
    why: str = ""
    """Reason of a failure, or why the block is not run."""
    printed: str = ""
    seconds: float = 0.0

    def __str__(self) -> str:
        """Return seconds, place, first line, status and reason."""
        place = f"{self.block.page}:{self.block.line}"
        first = self.block.code.partition("\n")[0]
        return f"{self.seconds:6.1f} s  {place}: {first}: {self.status}: {self.why}".rstrip(": ")


class Session:
    """A page that is run from top to bottom in the current folder."""

    def __init__(self, page: str, rules: Rules) -> None:
        self.blocks = read_blocks(page, Path())
        self.rules = rules
        self.names: dict[str, Any] = {"__name__": "__main__"}
        """Names that the Python blocks of the page have defined."""
        self.has_trained = any(_TRAINS.search(command) for command in rules.before)

    def run(self) -> list[Outcome]:
        """Run every block and print its outcome."""
        for command in self.rules.before:
            printed, status = run_command(command)
            if status:
                raise RuntimeError(f"{command}: exit status {status}\n{printed}")
        outcomes = []
        for block in self.blocks:
            outcomes.append(self.run_block(block))
            print(outcomes[-1], flush=True)
        return outcomes

    def run_block(self, block: Block) -> Outcome:
        """Run a block and compare its output with the page."""
        if why := self.rules.why_not_run(block):
            return Outcome(block, NOT_RUN, why)
        begin = time.perf_counter()
        try:
            printed, why = self._execute(block)
        except BaseException:  # of the page's code, SystemExit included
            printed, why = "", traceback.format_exc()
        status = SMALLER if self.rules.is_smaller(block) else RAN
        self.has_trained |= bool(_TRAINS.search(block.code))
        missing = None if why else find_difference(block.shown, printed)
        if missing is not None and self.has_trained:
            status, missing = OTHER_NUMBERS, find_different_words(block.shown, printed)
        if missing is not None:
            why = f"the page shows, but the program did not print: {missing}"
        seconds = time.perf_counter() - begin
        return Outcome(block, FAILED if why else status, why, printed, seconds)

    def _execute(self, block: Block) -> tuple[str, str]:
        """Run a block; return what it printed and why it failed, if it did."""
        if block.title:
            Path(block.title).parent.mkdir(parents=True, exist_ok=True)
            Path(block.title).write_text(block.code)
            return "", ""
        if block.kind == COMMAND:
            printed, status = run_command(self.rules.make_command(block))
            expected = f"exit status {status} instead of {block.status}"
            return printed, "" if status == block.status else f"{expected}\n{printed[-2000:]}"
        if block.kind == PYTHON:
            return run_python(block.code, f"{block.page}:{block.line}", self.names), ""
        return "", f"a block of {block.kind or 'no language'} that is neither run nor listed"


def run_command(command: str) -> tuple[str, int]:
    """Run a command in bash; return what it printed and its exit status."""
    completed = subprocess.run(
        ["bash", "-c", command],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
        timeout=LIMIT,
    )
    return completed.stdout, completed.returncode


def show(value: Any) -> None:
    """Print the value of a block's last line."""
    if value is not None:
        print(value)


def run_python(
    code: str, where: str, names: dict[str, Any], show: Callable[[Any], None] = show
) -> str:
    """Run a block as a notebook would.

    Args:
        code: The block.
        where: Its place, for tracebacks.
        names: Names that it can use, to which it adds its own.
        show: Displays the value of its last line.

    Returns:
        What it printed.
    """
    tree = ast.parse(code)
    last: Any = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        exec(compile(tree, where, "exec"), names)
        if last is not None:
            show(eval(compile(ast.Expression(last.value), where, "eval"), names))
    return printed.getvalue()


def update_page(page: Path, outcomes: Sequence[Outcome]) -> None:
    """Replace shown outputs that were not printed; print those that omit text, to shorten by hand.

    Args:
        page: The page.
        outcomes: Outcome of each block of the page.
    """
    lines = page.read_text().splitlines()
    for outcome in reversed(outcomes):  # from the end, so that earlier lines keep their numbers
        block, (first, end) = outcome.block, outcome.block.shown_lines
        is_true = block.shown and find_difference(block.shown, outcome.printed) is None
        if is_true or not (first and outcome.printed):
            continue
        if OMITTED in block.shown:
            print(f"{page}:{block.line}: shorten by hand: {outcome.printed}")
        else:
            lines[first - 1 : end - 1] = outcome.printed.strip("\n").splitlines()
    page.write_text("".join(f"{line}\n" for line in lines))


def main(page: str, *flags: str) -> int:
    """Run a page in the current folder and return the exit status."""
    sys.path.insert(0, os.getcwd())
    rules = read_rules(page)
    if "--time" in flags:
        rules = dataclasses.replace(rules, smaller={})
    outcomes = Session(page, rules).run()
    if "--update" in flags:
        update_page(Path(page), outcomes)
    failed = sum(outcome.status == FAILED for outcome in outcomes)
    seconds = sum(outcome.seconds for outcome in outcomes)
    print(f"{page}: {len(outcomes)} blocks, {failed} failed, {seconds:.0f} s", flush=True)
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
