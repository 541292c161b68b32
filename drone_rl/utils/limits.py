"""Limits on files, which all readers check before they allocate memory.

Reading a file takes less than 1 GiB of memory and about two seconds, except the saved state of a
proof with many boxes; the metrics of a large sweep take about half a minute together. Readers check
the limits on what a file states (its size, a directory, a header, the number of separators) before
they parse the content. `where` names the file or a part of it in messages.
"""

import math
from collections.abc import Sequence
from typing import Any

from numpy.typing import NDArray

from drone_rl.utils.errors import InputError

# Sizes of files in bytes
SMALL_JSON_BYTES = 10**6  # state of a training, reason of a failure
RESULT_BYTES = 2**18  # result.json
SWEEP_RESULTS_BYTES = 2**24  # result.json and failure.json of all runs of a sweep together
SWEEP_BYTES = 2**24  # sweep.json
EXPLANATION_BYTES = 2**22  # explanation.json
SHIFTS_BYTES = 2**26  # shifts.json, most of which are images
CERTIFICATE_BYTES = 2**25
LEDGER_BYTES = 2**24  # results of benchmarks
YAML_BYTES = 2**16  # overrides of a run, a required domain
METRICS_BYTES = 2**25  # metrics.csv of one run
SWEEP_METRICS_BYTES = 2**30  # metrics.csv of all runs of a sweep together
LOG_BYTES = 2**16  # end of a log that is searched for an error
JOURNAL_BYTES = 2**23  # journal of a search by Optuna
CHECKPOINT_BYTES = 2**28  # a checkpoint; also unpacked
ARCHIVE_BYTES = 2**28  # least limit of an .npz file, compressed; see `read_arrays`
ARRAYS_BYTES = 5 * 2**26  # the .npz files of one command together, unpacked
FILM_BYTES = 2**23  # the film of a report

# Counts
JSON_VALUES = 2**18  # values in a JSON file, without names
CERTIFICATE_VALUES = 3 * 2**19  # those in a certificate, nearly all of them borders of boxes
FILM_STEPS = 2000  # steps of the film of a report
JSON_DEPTH = 64  # levels of lists and mappings in a JSON file
YAML_DEPTH = 16  # those in a YAML file
YAML_VALUES = 2000  # values and names in a YAML file
PICKLED_BYTES = 2**20  # instructions in a checkpoint: everything but the numbers of its tensors
MEMBERS = 10_000  # files in one archive
DIMENSIONS = 8  # of an array
ELEMENTS = 2**30  # of an array; also of one without any, if its dimensions of 0 were 1
METRICS_ROWS = 2**17  # updates in metrics.csv
METRICS_CELLS = 2**22  # cells in metrics.csv
SWEEP_METRICS_ROWS = 2**22  # updates in metrics.csv of all runs of a sweep together
SWEEP_METRICS_CELLS = 2**27  # cells in these
FOLDER_ENTRIES = 50_000  # files and folders below a folder that is searched for links


class Allowance:
    """A limit that several files share, such as the arrays of all explanations in a report."""

    def __init__(self, most: int, unit: str = "bytes") -> None:
        """Set the sum that may be taken and its unit for messages."""
        self.left = most
        self._most, self._unit = most, unit

    def take(self, amount: int, where: str) -> None:
        """Take an amount for a file; raise an `InputError` if less is left."""
        if amount > self.left:
            left = "" if self.left == self._most else f"the {self.left} left of "
            raise InputError(
                f"{where} has {amount} {self._unit}, more than {left}{self._most} {self._unit}; "
                "give fewer or smaller files"
            )
        self.left -= amount


def check_json_size(content: bytes | str, where: str, most: int = JSON_VALUES) -> None:
    """Raise an `InputError` if JSON may have more values, by its separators before it is parsed."""
    if isinstance(content, str):
        count = sum(content.count(mark) for mark in ",[{")
    else:
        count = sum(content.count(mark) for mark in (b",", b"[", b"{"))
    if count >= most:
        raise InputError(f"{where} holds more than {most} values; files of its kind have fewer")


def check_depth(value: Any, where: str, most: int = JSON_DEPTH) -> None:
    """Raise an `InputError` if lists and dicts are nested more than `most` times."""
    level = _containers([value])
    for _ in range(most):
        level = [inner for outer in level for inner in _containers(outer)]
        if not level:
            return
    raise InputError(f"{where} is nested more than {most} times; files of its kind are not")


def _containers(value: list[Any] | dict[Any, Any]) -> list[Any]:
    inside = value.values() if isinstance(value, dict) else value
    return [inner for inner in inside if isinstance(inner, (list, dict))]


def check_shape(shape: Sequence[int], itemsize: int, most: int, where: str) -> int:
    """Return the number of elements of an array whose shape a file states.

    A dimension of 0 counts as 1, so that no array without elements has a huge shape. An element has
    `itemsize` bytes, and the array may have `most`.

    Raises:
        InputError: It is too large, has too many dimensions, or elements of no size.
    """
    if len(shape) > DIMENSIONS or itemsize <= 0 or any(length < 0 for length in shape):
        raise InputError(f"{where} has {len(shape)} dimensions, elements of {itemsize} bytes")
    if itemsize * math.prod(max(1, length) for length in shape) > most:
        raise InputError(f"{where} has the shape {tuple(shape)}: more than {most} bytes")
    return math.prod(shape)


def check_indices(values: NDArray[Any], most: int, where: str) -> None:
    """Raise an `InputError` unless an array has integers from 0 to below `most` only."""
    if values.dtype.kind not in "iub":
        raise InputError(f"{where} is of type {values.dtype}, not of whole numbers")
    if values.size and not (int(values.min()) >= 0 and int(values.max()) < most):
        raise InputError(
            f"{where} holds {int(values.min())} to {int(values.max())}; its numbers must be at "
            f"least 0 and below {most}"
        )
