"""Store measured figures in a file, with the revision, the date and the machine of each benchmark.

The file maps keys to figures. Its entry "benchmarks" holds the origin of each benchmark's figures.
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
"""Key of the entry that holds the origins."""
_ROOT = Path(__file__).resolve().parents[1]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Origin:
    """Where the figures of one benchmark come from."""

    revision: str | None
    """Commit of the checkout, with "-dirty" if it was changed; None outside one."""
    date: str
    """Date of the measurement, YYYY-MM-DD."""
    machine: str
    """Cores, processor and operating system."""
    code: str | None
    """Digest of the measured code; None if unknown."""
    settings: dict[str, Any]
    """Settings of the measurement."""
    keys: tuple[str, ...]
    """Keys of the benchmark's figures."""


class Ledger:
    """A results file: figures by key, and the origin of each benchmark's figures."""

    def __init__(self, path: Path) -> None:
        """Read the file; a missing file counts as empty.

        Raises:
            InputError: The file is not a results file.
        """
        self.path = path
        self.figures: dict[str, Any] = {}
        """Figures by key."""
        self.origins: dict[str, Origin] = {}
        """Origins by benchmark."""
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
                f"{self.path} is not a benchmark results file ({error!r}); move it away"
            ) from error

    def add(self, name: str, figures: Figures, origin: Origin) -> None:
        """Replace a benchmark's figures and write the file."""
        if name in self.origins:
            for key in self.origins[name].keys:
                self.figures.pop(key, None)
        self.figures |= figures
        self.origins[name] = dataclasses.replace(origin, keys=tuple(figures))
        origins = {n: dataclasses.asdict(o) for n, o in self.origins.items()}
        text = json.dumps({**self.figures, ORIGINS: origins}, indent=1)
        write_atomically(self.path, text + "\n")

    def of(self, name: str) -> dict[str, Any]:
        """Return the figures of one benchmark; empty if it has not run."""
        keys = self.origins[name].keys if name in self.origins else ()
        return {key: self.figures[key] for key in keys}

    def is_current(self, name: str, code: str, settings: dict[str, Any]) -> bool:
        """Return whether the figures come from this code, these settings and this machine."""
        origin = self.origins.get(name)
        current = (code, settings, describe_machine())
        return origin is not None and (origin.code, origin.settings, origin.machine) == current


def make_origin(code: str, settings: dict[str, Any]) -> Origin:
    """Return the origin of figures measured now on this machine; `keys` is empty."""
    return Origin(
        revision=git_revision(),
        date=datetime.date.today().isoformat(),
        machine=describe_machine(),
        code=code,
        settings=settings,
        keys=(),
    )


def digest_code(measures: Iterable[str], root: Path = _ROOT) -> str:
    """Return a digest of source files and settings.

    Args:
        measures: Packages and modules of drone_rl, such as "sim", or modules of benchmarks, such
            as "benchmarks/speed"; "conf" stands for the YAML files in conf/.
        root: Folder of the checkout.

    Raises:
        FileNotFoundError: A package or module does not exist.
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
    """Return cores, processor and operating system in one line."""
    return f"{num_cores()} cores, {_processor()}, {platform.system()}"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()
