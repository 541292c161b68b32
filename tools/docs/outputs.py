"""Compare a shown output with the printed one."""

import re

OMITTED = "[...]"
_VARYING = (
    # escape sequences of terminals; progress that a later line overwrites
    (r"\x1b\[[0-9;]*[A-Za-z]", ""),
    (r"[^\n]*\r(?!\n)", ""),
    # names of run folders, times and dates
    (r"\d{4}-\d\d-\d\d[_T /]\d\d[-:]\d\d[-:]\d\d[\w.-]*", "<time>"),
    (r"\d{4}-\d\d-\d\d", "<date>"),
    # durations
    (r"\b\d+(?:\.\d+)?(?= ?(?:s|seconds?|minutes?)\b)", "<n>"),
    # speeds
    (r"\b[\d,.]+(?= (?:frames|episodes)/s)", "<n>"),
    # fresh seeds
    (r"\bseed \d{6,}", "seed <n>"),
    # line breaks and indentation
    (r"\s+", " "),
)
"""What may differ between two runs of the same command, and its replacement."""


def find_difference(shown: str, printed: str) -> str | None:
    """Return the first shown text that was not printed; None if all was printed in this order.

    Args:
        shown: Output on the page; "[...]" stands for omitted text.
        printed: Output of the program.
    """
    rest = normalize(printed)
    for text in map(normalize, shown.split(OMITTED)):
        _, found, rest = rest.partition(text) if text else ("", "found", rest)
        if not found:
            return text
    return None


def normalize(text: str) -> str:
    """Return a text without the parts that differ from run to run."""
    for pattern, replacement in _VARYING:
        text = re.sub(pattern, replacement, text)
    return text.strip()


def find_different_words(shown: str, printed: str) -> str | None:
    """Return the first shown text that was not printed, numbers aside.

    Tests run smaller trainings on any processor, so they compare words only.
    """
    return find_difference(_without_numbers(shown), _without_numbers(printed))


def _without_numbers(text: str) -> str:
    return re.sub(r"[-+]?\d+(?:[.,:]\d+)*(?:e[-+]?\d+)?", "0", text)
