"""Measured figures in a file: each benchmark's with the code, the day and the machine they are of.

The file holds the figures by their keys and, under "benchmarks", where each benchmark's come from.
"""

import dataclasses
import datetime
import hashlib
import json
import platform
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from benchmarks.benchmark import Figures
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import read_json, write_atomically
from drone_rl.utils.limits import LEDGER_BYTES
from drone_rl.utils.provenance import git_revision, num_cores

ORIGINS = "benchmarks"
"""The entry that is no figure."""
_ROOT = Path(__file__).resolve().parents[1]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Origin:
    """Where the figures of one benchmark come from."""

    revision: str | None
    """Commit of the checkout, with "-dirty" if it was changed; None outside one."""
    date: str
    """Day, as YYYY-MM-DD."""
    machine: str
    """Processor and system."""
    code: str | None
    """Digest of the code that was measured; None if unknown."""
    settings: dict[str, Any]
    """Of the measurement."""
    keys: tuple[str, ...]
    """Its figures."""


class Ledger:
    """A file of figures."""

    def __init__(self, path: Path) -> None:
        """Reads the file; one that is not there yet is empty.

        Raises:
            InputError: It can't be read.
        """
        self.path = path
        self.figures: dict[str, Any] = {}
        """By key."""
        self.origins: dict[str, Origin] = {}
        """By the benchmarks' names."""
        if path.exists():
            self._read(read_json(path, LEDGER_BYTES))

    def _read(self, content: Any) -> None:
        try:
            for name, entry in content.get(ORIGINS, {}).items():
                origin = Origin(**{**entry, "keys": tuple(entry["keys"])})
                self.figures |= {key: content[key] for key in origin.keys}
                self.origins[name] = origin
        except (AttributeError, KeyError, TypeError) as error:
            raise InputError(
                f"{self.path} holds no figures of benchmarks ({error!r}); move it away"
            ) from error

    def add(self, name: str, figures: Figures, origin: Origin) -> None:
        """Puts a benchmark's figures in place of its older ones, and writes the file."""
        if name in self.origins:
            for key in self.origins[name].keys:
                self.figures.pop(key, None)
        self.figures |= figures
        self.origins[name] = dataclasses.replace(origin, keys=tuple(figures))
        origins = {n: dataclasses.asdict(o) for n, o in self.origins.items()}
        text = json.dumps({**self.figures, ORIGINS: origins}, indent=1)
        write_atomically(self.path, text + "\n")

    def of(self, name: str) -> dict[str, Any]:
        """The figures of one benchmark, empty if it was not run."""
        keys = self.origins[name].keys if name in self.origins else ()
        return {key: self.figures[key] for key in keys}

    def is_current(self, name: str, code: str, settings: dict[str, Any]) -> bool:
        """Whether a benchmark was run with just this code, these settings and this machine."""
        origin = self.origins.get(name)
        here = (code, settings, describe_machine())
        return origin is not None and (origin.code, origin.settings, origin.machine) == here


def make_origin(code: str, settings: dict[str, Any]) -> Origin:
    """The origin of figures that are measured here and now."""
    return Origin(
        revision=git_revision(),
        date=datetime.date.today().isoformat(),
        machine=describe_machine(),
        code=code,
        settings=settings,
        keys=(),
    )


def digest_code(measures: Iterable[str], root: Path = _ROOT) -> str:
    """A digest of packages, modules and settings.

    Args:
        measures: Packages and modules below drone_rl, such as "sim", or modules of benchmarks, such
            as "benchmarks/speed"; "conf" means the settings.
        root: Of the checkout.

    Raises:
        FileNotFoundError: There is no such package or module.
    """
    files = []
    for name in sorted(measures):
        if name == "conf":
            files += sorted((root / name).rglob("*.yaml"))
        else:
            path = root / name if name.startswith("benchmarks/") else root / "drone_rl" / name
            files += sorted(path.rglob("*.py")) if path.is_dir() else [path.with_suffix(".py")]
    digest = hashlib.sha256()
    for file in files:
        digest.update(f"{file.name}\0".encode() + file.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def describe_machine() -> str:
    """Cores, processor and system in a line."""
    return f"{num_cores()} cores, {_processor()}, {platform.system()}"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()
