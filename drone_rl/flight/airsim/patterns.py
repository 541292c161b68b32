"""Regular expressions that clients send, as for the names of objects."""

import re
from collections.abc import Iterable

from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import shown

_REPETITION = re.compile(r"(?<!\\)[*+?{]")
_REPEATED_GROUP = re.compile(r"\)[*+?{]")
_MOST_REPETITIONS = 3


def matching(pattern: str, names: Iterable[str]) -> list[str]:
    """Return the names that match a regular expression, ignoring case, as a whole.

    Raises:
        InputError: It is none, or one whose search could take forever.
    """
    parts = [pattern] if "(" in pattern else pattern.split("|")
    most = max(len(_REPETITION.findall(part)) for part in parts)
    if most > _MOST_REPETITIONS or _REPEATED_GROUP.search(pattern):
        raise InputError(
            f"name={shown(pattern)} repeats too much; give at most {_MOST_REPETITIONS} of * + ? "
            "and {, and none after a group"
        )
    try:
        compiled = re.compile(pattern, re.IGNORECASE)
    except (re.error, RecursionError, OverflowError) as error:
        raise InputError(f"name={shown(pattern)} is no regular expression ({error})") from error
    return [name for name in names if compiled.fullmatch(name)]
