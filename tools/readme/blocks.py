"""Generated blocks of a Markdown file, each between two markers."""

import re
from collections.abc import Mapping

_BLOCK = re.compile(r"(<!-- made: (\w+) -->\n).*?(<!-- /made -->)", re.DOTALL)


def replace_blocks(text: str, blocks: Mapping[str, str]) -> str:
    """Return a text with its generated blocks replaced.

    Args:
        text: Markdown with `<!-- made: NAME -->` before and `<!-- /made -->` after each block.
        blocks: Contents of the blocks by name.

    Raises:
        ValueError: The text marks a block that is not in `blocks`.
    """
    unknown = marked_blocks(text) - set(blocks)
    if unknown:
        raise ValueError(f"blocks {sorted(unknown)} are unknown; use one of {sorted(blocks)}")
    return _BLOCK.sub(lambda match: f"{match[1]}{blocks[match[2]].strip()}\n{match[3]}", text)


def marked_blocks(text: str) -> set[str]:
    """Return the names of the blocks in a text."""
    return {match.group(2) for match in _BLOCK.finditer(text)}
