"""An explanation's files, read back: plain numbers and arrays."""

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drone_rl.utils.errors import InputError

FORMAT = "drone_rl explanation"
FORMAT_VERSION = 2
ACTIONS = ("forward", "left", "right")
"""By number, as in the files."""


@dataclasses.dataclass
class Explanation:
    """What `drone-rl explain` wrote about one policy."""

    numbers: dict[str, Any]
    """explanation.json"""
    arrays: dict[str, NDArray]
    """arrays.npz"""
    data: dict[str, NDArray]
    """The arrays of dataset.npz."""

    @property
    def name(self) -> str:
        """Of the policy."""
        return str(self.numbers["name"])

    @classmethod
    def load(cls, folder: Path) -> "Explanation":
        """Reads a folder.

        Raises:
            InputError: A file is missing, damaged, or of another version.
        """
        try:
            numbers = json.loads((folder / "explanation.json").read_text())
            with np.load(folder / "arrays.npz", allow_pickle=False) as file:
                arrays = {name: file[name] for name in file.files}
            with np.load(folder / "dataset.npz", allow_pickle=False) as file:
                data = {name: file[name] for name in file.files if name != "meta"}
        except (OSError, ValueError, KeyError, EOFError) as error:
            raise InputError(
                f"explanation {folder} can't be read ({error}); run drone-rl explain again"
            ) from error
        if numbers.get("format") != FORMAT or numbers.get("format_version") != FORMAT_VERSION:
            raise InputError(
                f"{folder} holds no explanation of format version {FORMAT_VERSION}; "
                "run drone-rl explain again"
            )
        return cls(numbers, arrays, data)
