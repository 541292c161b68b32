"""One run of a sweep and the files in its folder."""

import dataclasses
import shlex
from pathlib import Path
from typing import Any

from drone_rl.utils.errors import InputError
from drone_rl.utils.files import parse_json, read_bytes, read_json
from drone_rl.utils.limits import RESULT_BYTES
from drone_rl.utils.readers import with_present_names
from drone_rl.utils.schema import Text, as_mapping

THREADS = {"OMP_NUM_THREADS": "1", "OMP_WAIT_POLICY": "PASSIVE"}
"""Environment of every run, so that parallel runs don't compete for the cores.

Training sets torch's threads itself, so that its result does not depend on this.
"""


@dataclasses.dataclass(frozen=True)
class Run:
    """One training run."""

    number: int
    """Index in the sweep, from 0."""
    overrides: tuple[str, ...]
    """Settings as command-line overrides."""
    folder: Path
    """Output folder."""

    @property
    def checkpoint(self) -> Path:
        """Path of the newest checkpoint."""
        return self.folder / "checkpoints" / "last.pt"

    @property
    def failure(self) -> Path:
        """Path of the failure's reason."""
        return self.folder / "failure.json"

    def arguments(self) -> list[str]:
        """Return the arguments of `drone-rl` that begin or resume this run."""
        folder = quoted(str(self.folder))
        own = ["hydra.mode=RUN", f"hydra.run.dir={folder}"]
        resume = [f"resume={folder}"] if self.checkpoint.is_file() else []
        return ["train", *self.overrides, *own, *resume]

    def repeat_command(self) -> str:
        """Return the shell command that repeats this training."""
        settings = [o for o in self.overrides if not o.startswith("trial=")]
        return shlex.join(["drone-rl", "train", *settings, "hydra.mode=RUN"])


def read_result(folder: Path) -> dict[str, Any] | None:
    """Return `result.json` of a finished run, or None for an unfinished one."""
    try:
        content = read_bytes(folder / "result.json", RESULT_BYTES)
        result = as_mapping(parse_json(content, "result", allow_nan=True), "result")
        reason = Text(100).read(result.get("reason"), "reason")
    except InputError:
        return None
    return None if reason.startswith("SIG") else with_present_names(result)


def read_failure(run: Run) -> str | None:
    """Return the error of a failed run, or None."""
    try:
        error = as_mapping(read_json(run.failure), "failure")["error"]
    except (InputError, KeyError):
        return None
    return "".join(c if c.isprintable() else " " for c in str(error)[:1000])


def quoted(value: str) -> str:
    """Quote a value for Hydra's command line."""
    escaped = value.replace("\\", "\\\\").replace("'", "\\'")
    return f"'{escaped}'"
