"""Read pages.toml: blocks that are not run, smaller sizes, placeholders and preparations."""

import dataclasses
import importlib.util
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
    needs: Mapping[str, str] = dataclasses.field(default_factory=dict)
    """Packages of extras, without which they are not run."""
    smaller: Mapping[str, str] = dataclasses.field(default_factory=dict)
    """Settings to append to commands that would take too long; an empty text for none."""
    replace: Mapping[str, str] = dataclasses.field(default_factory=dict)
    """Values of placeholders: what bash replaces them by."""
    before: Sequence[str] = ()
    """Commands that produce the files with which the page begins."""

    def why_not_run(self, block: Block) -> str | None:
        """Return why a block is not run; None if it is run."""
        needed = _longest(self.needs, block.code)
        if needed is not None and importlib.util.find_spec(self.needs[needed]) is None:
            return f"needs the package {self.needs[needed]}"
        key = _longest(self.not_run, block.code)
        return None if key is None else self.not_run[key]

    def is_smaller(self, block: Block) -> bool:
        """Return whether a block is run with smaller sizes."""
        return block.kind == COMMAND and self._added(block) != ""

    def _added(self, block: Block) -> str:
        """Return the settings that make a command smaller."""
        return self.smaller.get(_longest(self.smaller, block.code) or "", "")

    def make_command(self, block: Block) -> str:
        """Return the command to run: without placeholders and with smaller sizes."""
        command, mark, comment = block.code.partition(" #")
        if self.is_smaller(block):
            command = f"{command.rstrip()} {self._added(block)}"
        for placeholder, value in self.replace.items():
            command = command.replace(placeholder, value)
        return command + mark + comment

    def find_unused(self, blocks: Sequence[Block]) -> list[str]:
        """Return the keys that apply to no block of the page."""
        codes = [block.code for block in blocks]
        keys = [*self.not_run, *self.needs, *self.smaller]
        unused = [key for key in keys if not any(code.startswith(key) for code in codes)]
        return unused + [key for key in self.replace if not any(key in code for code in codes)]


def read_rules(file: Path = FILE) -> dict[str, Rules]:
    """Return the rules by page; those under "all" hold for every page."""
    return {page: Rules(**content) for page, content in tomllib.loads(file.read_text()).items()}


def rules_for(page: str, rules: Mapping[str, Rules]) -> Rules:
    """Return the rules of one page, together with those of all pages."""
    general, own = rules.get(ALL, Rules()), rules.get(page, Rules())
    merged: dict[str, Any] = {
        name: {**getattr(general, name), **getattr(own, name)}
        for name in ("not_run", "needs", "smaller", "replace")
    }
    return Rules(**merged, before=[*general.before, *own.before])


def _longest(keys: Mapping[str, str], code: str) -> str | None:
    """Return the longest key with which the code begins."""
    return max((key for key in keys if code.startswith(key)), key=len, default=None)
