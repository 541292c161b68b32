"""Write the printed outputs into a page."""

from collections.abc import Sequence
from pathlib import Path

from tools.docs.blocks import ROOT, Block, read_blocks
from tools.docs.outputs import OMITTED, find_difference
from tools.docs.session import Outcome


def update_page(page: str, outcomes: Sequence[Outcome], root: Path = ROOT) -> list[str]:
    """Replace shown outputs that were not printed; return those to shorten by hand.

    An output that omits text is not replaced, because only its author knows what to omit.

    Args:
        page: Path of the page, relative to the checkout.
        outcomes: Outcome of each block of the page.
        root: Folder of the checkout.
    """
    path, left = root / page, []
    lines = path.read_text().splitlines()
    pairs = list(zip(read_blocks(page, root), outcomes, strict=True))
    for block, outcome in reversed(pairs):  # from the end, so that earlier lines keep their numbers
        if not _is_outdated(block, outcome):
            continue
        if OMITTED in block.shown:
            left.append(f"{page}:{block.line}: {outcome.printed}")
        else:
            first, end = block.shown_lines
            lines[first - 1 : end - 1] = outcome.printed.strip("\n").splitlines()
    Path(path).write_text("".join(f"{line}\n" for line in lines))
    return left


def _is_outdated(block: Block, outcome: Outcome) -> bool:
    """Return whether the block printed something else than the page shows."""
    if not block.shown_lines[0] or not outcome.printed:
        return False
    return not block.shown or find_difference(block.shown, outcome.printed) is not None
