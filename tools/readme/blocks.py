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
        ValueError: The text marks a block that is none of these.
    """
    unknown = marked_blocks(text) - set(blocks)
    if unknown:
        raise ValueError(f"nobody makes the blocks {sorted(unknown)}; there are {sorted(blocks)}")
    return _BLOCK.sub(lambda match: f"{match[1]}{blocks[match[2]].strip()}\n{match[3]}", text)


def marked_blocks(text: str) -> set[str]:
    """Names of a text's blocks."""
    return {match.group(2) for match in _BLOCK.finditer(text)}
