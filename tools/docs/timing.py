"""Time a page as a reader would run it: `python -m tools.docs --time PAGE ...`.

No command is made smaller. Each Python block is a program of its own, and `drone-rl demo` stands
for `make demo`, which installs the package first. A silence is a time without any output.
"""

import dataclasses
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from tools.docs.blocks import PYTHON, ROOT, Block, read_blocks
from tools.docs.rules import read_rules, rules_for
from tools.docs.run import RESULTS, copy_checkout


@dataclasses.dataclass(frozen=True)
class Timing:
    """Times of one block."""

    code: str
    """First line."""
    seconds: float
    silence: float
    """Longest time without output, from the start to the end, seconds."""
    is_expected: bool
    """Whether the exit status was that of the page."""

    def __str__(self) -> str:
        """Return one line."""
        failed = "" if self.is_expected else "  FAILED"
        return f"{self.seconds:6.1f} s, silence {self.silence:5.1f} s: {self.code}{failed}"


def time_page(page: str, root: Path = ROOT, results: Path = RESULTS) -> Iterator[Timing]:
    """Run the blocks of a page in a new copy of the checkout; yield the times of each."""
    folder = results / f"timed_{page.removesuffix('.md').replace('/', '_')}"
    environment = {**copy_checkout(folder, root), "PYTHONUNBUFFERED": "1"}
    rules = dataclasses.replace(rules_for(page, read_rules()), smaller={})
    for block in read_blocks(page, root):
        block = dataclasses.replace(block, code=block.code.replace("make demo", "drone-rl demo"))
        if rules.why_not_run(block) is None and not block.title:
            python = [sys.executable, "-c", block.code]
            command = ["bash", "-c", rules.make_command(block)]
            yield time_block(
                block, python if block.kind == PYTHON else command, folder, environment
            )


def time_block(
    block: Block, command: list[str], folder: Path, environment: dict[str, str]
) -> Timing:
    """Run the command of a block in a folder."""
    begin = last = time.monotonic()
    silence = 0.0
    process = subprocess.Popen(
        command,
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    assert process.stdout is not None
    output = b"more"
    while output:
        output = os.read(process.stdout.fileno(), 1 << 16)  # empty at the end
        now = time.monotonic()
        silence, last = max(silence, now - last), now
    first = block.code.partition("\n")[0]
    return Timing(first, last - begin, silence, process.wait() == block.status)


def describe(page: str, timings: list[Timing]) -> str:
    """Return a page's minutes and its longest silence."""
    longest = max(timings, key=lambda timing: timing.silence)
    return (
        f"{page}: {sum(timing.seconds for timing in timings) / 60:.1f} minutes; longest silence "
        f"{longest.silence:.0f} s, of: {longest.code}"
    )
