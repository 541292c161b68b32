"""Read the commands, code blocks and shown outputs of a page."""

import dataclasses
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
COMMAND, PYTHON = "command", "python"
SHELLS = ("sh", "bash", "console")
OUTPUTS = ("text", "json")
_FENCE = re.compile(r'^```(\w*)(?: title="([^"]+)")?$')
_PROMPT = "$ "


@dataclasses.dataclass(frozen=True, kw_only=True)
class Block:
    """A command, or a block of code or data."""

    page: str
    """Path of the page, relative to the checkout."""
    line: int
    """Line of the page, counted from 1, in which it begins."""
    kind: str
    """"command", "python" or another language."""
    code: str
    title: str | None = None
    """Name of the file that the block is written to."""
    shown: str = ""
    """Output that the page shows."""
    shown_lines: tuple[int, int] = (0, 0)
    """First line of the shown output and the line after the last, counted from 1."""

    @property
    def status(self) -> int:
        """Exit status that the command's comment states, otherwise 0."""
        stated = re.search(r"#.*\bexit status (\d+)\b(?! unless| if)", self.code)
        return int(stated[1]) if stated and self.kind == COMMAND else 0


def find_pages(root: Path = ROOT) -> list[str]:
    """Return the paths of README.md and of all pages below docs/."""
    pages = [root / "README.md", *sorted((root / "docs").rglob("*.md"))]
    return [page.relative_to(root).as_posix() for page in pages]


def read_blocks(page: str, root: Path = ROOT) -> list[Block]:
    """Return the commands and blocks of a page in their order, with the output shown for each.

    Args:
        page: Path of the page, relative to the checkout.
        root: Folder of the checkout.

    Raises:
        ValueError: A fence is not closed, or shows an output of nothing.
    """
    blocks: list[Block] = []
    for start, language, title, lines in _fences(page, (root / page).read_text().splitlines()):
        if language in SHELLS:
            blocks += _commands(page, start, lines, prompted=language == "console")
        elif language in OUTPUTS and not title:
            if not blocks:
                raise ValueError(f"{page}:{start}: the output of nothing")
            area = (start + 1, start + 1 + len(lines))
            shown = "\n".join(lines)
            blocks[-1] = dataclasses.replace(blocks[-1], shown=shown, shown_lines=area)
        elif language != "diagram":
            code = "".join(f"{line}\n" for line in lines)
            blocks.append(Block(page=page, line=start, kind=language, code=code, title=title))
    return blocks


def _fences(page: str, lines: list[str]) -> Iterator[tuple[int, str, str | None, list[str]]]:
    """Yield first line, language, title and content of each fenced block."""
    opening, start = None, 0
    for number, line in enumerate(lines, 1):
        if not line.lstrip().startswith("```"):
            continue
        if opening is not None:
            yield start, opening[1], opening[2], lines[start : number - 1]
            opening = None
        elif opening := _FENCE.match(line):
            start = number
        else:
            raise ValueError(f"{page}:{number}: a fence that is not understood: {line}")
    if opening is not None:
        raise ValueError(f"{page}:{start}: a fence that is not closed")


def _commands(page: str, start: int, lines: list[str], *, prompted: bool) -> list[Block]:
    """Return a block for each command; what follows a command with a prompt is its output."""
    commands: list[Block] = []
    for number, line in enumerate(lines, start + 1):
        if prompted and not line.startswith(_PROMPT):
            last = commands[-1]
            area = (last.shown_lines[0] or number, number + 1)
            shown = f"{last.shown}\n{line}".strip("\n")
            commands[-1] = dataclasses.replace(last, shown=shown, shown_lines=area)
        elif line and not line.startswith("#"):
            code = line.removeprefix(_PROMPT)
            commands.append(Block(page=page, line=number, kind=COMMAND, code=code))
    return commands
