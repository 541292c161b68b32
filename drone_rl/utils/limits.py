"""How much a file may hold: the one table of sizes that all readers check before they allocate.

Whatever is in a file, reading it takes less than 1 GiB of memory and about two seconds. A reader
takes its limits from here and checks them on what the file states (its size, a directory, a
header, the number of separators) before it makes anything of the content.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from numpy.typing import NDArray

from drone_rl.utils.errors import InputError

# Sizes of files, bytes.
SMALL_JSON_BYTES = 10**6
"""A JSON file of no other kind: the state of a training, the reason of a failure."""
RESULT_BYTES = 2**18
"""`result.json`."""
SWEEP_RESULTS_BYTES = 2**24
"""`result.json` and `failure.json` of all runs of a sweep together."""
SWEEP_BYTES = 2**24
"""`sweep.json`."""
EXPLANATION_BYTES = 2**22
"""`explanation.json`."""
SHIFTS_BYTES = 2**26
"""`shifts.json`, most of which are images."""
CERTIFICATE_BYTES = 2**25
"""A certificate."""
LEDGER_BYTES = 2**24
"""Results of benchmarks."""
YAML_BYTES = 2**16
"""A YAML file: overrides of a run, a domain that is required."""
METRICS_BYTES = 2**24
"""`metrics.csv` of one run."""
LOG_BYTES = 2**16
"""The end of a log that is searched for an error."""
JOURNAL_BYTES = 2**23
"""The journal of a search by Optuna."""
CHECKPOINT_BYTES = 2**28
"""A checkpoint; also what it unpacks to."""
ARCHIVE_BYTES = 2**28
"""An `.npz` file as it lies on the disk."""
ARRAYS_BYTES = 5 * 2**26
"""The `.npz` files of one command together, unpacked."""

# Counts.
JSON_VALUES = 2**18
"""Values and names in a JSON file."""
EXPLANATION_VALUES = 2**16
"""Those in `explanation.json`."""
CERTIFICATE_VALUES = 3 * 2**19
"""Those in a certificate, nearly all of them borders of boxes."""
JSON_DEPTH = 64
"""Levels of lists and mappings in a JSON file."""
YAML_DEPTH = 16
"""The same in a YAML file."""
YAML_VALUES = 2000
"""Values and names in a YAML file."""
PICKLED_BYTES = 2**20
"""Instructions in a checkpoint: everything but the numbers of its tensors."""
MEMBERS = 10_000
"""Files in one archive."""
DIMENSIONS = 8
"""Of an array."""
ELEMENTS = 2**30
"""Of an array; also of one without any, if its dimensions of 0 were 1."""
METRICS_ROWS = 2**17
"""Updates in `metrics.csv`."""
METRICS_CELLS = 2**21
"""Cells in `metrics.csv`."""
SWEEP_METRICS_BYTES = 2**26
"""`metrics.csv` of all runs of a sweep together."""
SWEEP_METRICS_ROWS = 2**19
"""Updates in these."""
SWEEP_METRICS_CELLS = 2**23
"""Cells in these."""
FOLDER_ENTRIES = 50_000
"""Files and folders below a folder that is searched for links."""


class Allowance:
    """A limit that several files share, such as the arrays of all explanations in a report."""

    def __init__(self, most: int, unit: str = "bytes") -> None:
        """Sets the limit.

        Args:
            most: The sum that may be taken.
            unit: What is counted, for messages.
        """
        self.left = most
        self._most, self._unit = most, unit

    def take(self, amount: int, where: str) -> None:
        """Takes a part of what is left.

        Args:
            amount: How much.
            where: Name of the file, for messages.

        Raises:
            InputError: Less is left.
        """
        if amount > self.left:
            left = "" if self.left == self._most else f", of which {self.left} are left"
            raise InputError(
                f"{where} has {amount} {self._unit}, more than {self._most} {self._unit}{left}; "
                "give fewer or smaller files"
            )
        self.left -= amount


def check_json_size(content: bytes | str, where: str, most: int = JSON_VALUES) -> None:
    """Refuses JSON with too many values, by its separators and before it is parsed.

    Args:
        content: The JSON; separators within texts count, too.
        where: Its name, for messages.
        most: Values and names that it may have.

    Raises:
        InputError: It may have more.
    """
    if isinstance(content, str):
        count = sum(content.count(mark) for mark in ",[{")
    else:
        count = sum(content.count(mark) for mark in (b",", b"[", b"{"))
    if count >= most:
        raise InputError(f"{where} holds more than {most} values; files of its kind have fewer")


def check_depth(value: Any, where: str, most: int = JSON_DEPTH) -> None:
    """Refuses plain data in which lists and mappings are nested too deeply.

    Raises:
        InputError: They are.
    """
    level = [value]
    for _ in range(most):
        level = [inner for outer in level for inner in _containers(outer)]
        if not level:
            return
    raise InputError(f"{where} is nested more than {most} times; files of its kind are not")


def _containers(value: Any) -> Iterator[Any]:
    if isinstance(value, Mapping):
        value = value.values()
    elif not isinstance(value, list):
        return
    yield from (inner for inner in value if isinstance(inner, list | Mapping))


def check_shape(shape: Sequence[int], itemsize: int, most: int, where: str) -> int:
    """Refuses the shape of an array that would be too large, also where a dimension is 0.

    Args:
        shape: As a file states it.
        itemsize: Bytes of one element.
        most: Bytes that the array may have.
        where: Its name, for messages.

    Returns:
        Number of elements.

    Raises:
        InputError: It is too large, has too many dimensions, or elements of no size.
    """
    if len(shape) > DIMENSIONS or itemsize <= 0 or any(length < 0 for length in shape):
        raise InputError(f"{where} has {len(shape)} dimensions, elements of {itemsize} bytes")
    if itemsize * math.prod(max(1, length) for length in shape) > most:
        raise InputError(f"{where} has the shape {tuple(shape)}: more than {most} bytes")
    return math.prod(shape)


def check_indices(values: NDArray[Any], most: int, where: str) -> None:
    """Refuses an array that is not one of whole numbers from 0 to below a limit.

    Args:
        values: Out of a file, to be used as indices or to be counted.
        most: The first number that is too high.
        where: Name of the array, for messages.

    Raises:
        InputError: A value is out of range or no whole number.
    """
    if values.dtype.kind not in "iub":
        raise InputError(f"{where} is of type {values.dtype}, not of whole numbers")
    if values.size and not (int(values.min()) >= 0 and int(values.max()) < most):
        raise InputError(
            f"{where} holds {int(values.min())} to {int(values.max())}; its numbers must be at "
            f"least 0 and below {most}"
        )
