"""Read pages.toml: blocks that are not run, smaller sizes, placeholders and preparations."""

import dataclasses
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tools.docs.blocks import COMMAND, Block

FILE = Path(__file__).with_name("pages.toml")
ALL = "all"
"""Name of the section that holds for every page."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Rules:
    """The rules of one page. Keys are the beginnings of blocks; the longest one decides."""

    not_run: Mapping[str, str] = dataclasses.field(default_factory=dict)
    """Reasons."""
    smaller: Mapping[str, str] = dataclasses.field(default_factory=dict)
    """Settings to append to commands that would take too long; an empty text for none."""
    replace: Mapping[str, str] = dataclasses.field(default_factory=dict)
    """Values of placeholders: what bash replaces them by."""
    before: Sequence[str] = ()
    """Commands that produce the files with which the page begins."""

    def why_not_run(self, block: Block) -> str | None:
        """Return why a block is not run; None if it is run."""
        return _longest(self.not_run, block.code)

    def make_command(self, block: Block) -> str:
        """Return the command to run: without placeholders and with smaller sizes."""
        command, mark, comment = block.code.partition(" #")
        if sizes := _longest(self.smaller, block.code):
            command = f"{command.rstrip()} {sizes}"
        for placeholder, value in self.replace.items():
            command = command.replace(placeholder, value)
        return command + mark + comment

    def is_smaller(self, block: Block) -> bool:
        """Return whether a block is run with smaller sizes."""
        return block.kind == COMMAND and bool(_longest(self.smaller, block.code))


def read_rules(page: str) -> Rules:
    """Return the rules of a page, together with those of all pages."""
    sections = tomllib.loads(FILE.read_text())
    merged: dict[str, Any] = {}
    for section in (sections[ALL], sections.get(page, {})):
        for name, content in section.items():
            merged[name] = content if name == "before" else {**merged.get(name, {}), **content}
    return Rules(**merged)


def _longest(rules: Mapping[str, str], code: str) -> str | None:
    """Return the value of the longest key with which the code begins."""
    keys = [key for key in rules if code.startswith(key)]
    return rules[max(keys, key=len)] if keys else None
