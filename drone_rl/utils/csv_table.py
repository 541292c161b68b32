"""Tables in CSV files, read row by row and bounded in size."""

import csv
import io
from collections.abc import Iterator
from pathlib import Path

from drone_rl.utils.errors import InputError
from drone_rl.utils.files import read_bytes
from drone_rl.utils.limits import METRICS_BYTES, METRICS_CELLS, METRICS_ROWS, Allowance


def read_table(path: Path, allowance: Allowance | None = None) -> Iterator[list[str]]:
    """Read the rows of a CSV file, its header first; empty rows are left out.

    Args:
        path: Of the file.
        allowance: Bytes that this file and others may have together.

    Yields:
        The cells of each row.

    Raises:
        InputError: The file can't be read, is too large, or is no CSV.
    """
    content = read_bytes(path, METRICS_BYTES)
    if allowance is not None:
        allowance.take(len(content), str(path))
    if max(content.count(b"\n"), content.count(b"\r")) > 1 + METRICS_ROWS:
        raise InputError(f"{path} has more than {METRICS_ROWS} rows; files of its kind have fewer")
    if content.count(b",") > METRICS_CELLS:
        raise InputError(
            f"{path} has more than {METRICS_CELLS} cells; files of its kind have fewer"
        )
    try:
        for row in csv.reader(io.StringIO(content.decode(), newline="")):
            if row:
                yield row
    except (csv.Error, UnicodeDecodeError) as error:
        raise InputError(f"{path} is damaged: no CSV ({error})") from None
