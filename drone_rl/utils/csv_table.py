"""Tables in CSV files, read row by row and bounded in size."""

import csv
import io
from collections.abc import Iterator
from pathlib import Path

from drone_rl.utils.errors import InputError
from drone_rl.utils.files import read_bytes
from drone_rl.utils.limits import (
    METRICS_BYTES,
    METRICS_CELLS,
    METRICS_ROWS,
    SWEEP_METRICS_BYTES,
    SWEEP_METRICS_CELLS,
    SWEEP_METRICS_ROWS,
    Allowance,
)


class TablesAllowance:
    """What the tables of one command may have together: bytes, rows and cells."""

    def __init__(
        self,
        size: int = SWEEP_METRICS_BYTES,
        rows: int = SWEEP_METRICS_ROWS,
        cells: int = SWEEP_METRICS_CELLS,
    ) -> None:
        """Sets the limits."""
        self.size = Allowance(size)
        self.rows = Allowance(rows, "rows")
        self.cells = Allowance(cells, "cells")


def read_table(path: Path, allowance: TablesAllowance | None = None) -> Iterator[list[str]]:
    """Read the rows of a CSV file, its header first; empty rows are left out.

    Args:
        path: Of the file.
        allowance: What this file and others may have together.

    Yields:
        The cells of each row.

    Raises:
        InputError: The file can't be read, is too large, or is no CSV.
    """
    if allowance is not None:
        allowance.size.take(_size(path), str(path))  # before it is read: there may be many
    content = read_bytes(path, METRICS_BYTES)
    rows = max(content.count(b"\n"), content.count(b"\r"))
    cells = content.count(b",")
    if rows > 1 + METRICS_ROWS:
        raise InputError(f"{path} has more than {METRICS_ROWS} rows; files of its kind have fewer")
    if cells > METRICS_CELLS:
        raise InputError(
            f"{path} has more than {METRICS_CELLS} cells; files of its kind have fewer"
        )
    if allowance is not None:
        allowance.rows.take(rows, str(path))
        allowance.cells.take(cells, str(path))
    try:
        for row in csv.reader(io.StringIO(content.decode(), newline="")):
            if row:
                yield row
    except (csv.Error, UnicodeDecodeError) as error:
        raise InputError(f"{path} is damaged: no CSV ({error})") from None


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except (OSError, ValueError):
        return 0  # the reader says what is wrong
