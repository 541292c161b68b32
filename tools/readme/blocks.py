"""Blocks of a Markdown file that are made by a program, each between two marks."""

import re
from collections.abc import Mapping

_BLOCK = re.compile(r"(<!-- made: (\w+) -->\n).*?(<!-- /made -->)", re.DOTALL)


def replace_blocks(text: str, blocks: Mapping[str, str]) -> str:
    """A text with its blocks made anew.

    Args:
        text: With `<!-- made: NAME -->` before and `<!-- /made -->` after each block.
        blocks: What stands between, by name.

    Raises:
        ValueError: The text has other blocks than these.
    """
    marked = [match.group(2) for match in _BLOCK.finditer(text)]
    if sorted(marked) != sorted(blocks):
        raise ValueError(f"the text marks blocks {sorted(marked)}, not {sorted(blocks)}")
    return _BLOCK.sub(lambda match: f"{match[1]}{blocks[match[2]].strip()}\n{match[3]}", text)
