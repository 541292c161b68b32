"""One run of a sweep, as its folder tells of it."""

import dataclasses
import shlex
from pathlib import Path
from typing import Any

from drone_rl.utils.errors import InputError
from drone_rl.utils.files import parse_json, read_bytes, read_json
from drone_rl.utils.limits import RESULT_BYTES
from drone_rl.utils.schema import Text, as_mapping

THREADS = {"OMP_NUM_THREADS": "1", "OMP_WAIT_POLICY": "PASSIVE"}
"""Environment of every run, in which those side by side don't fight for the cores.

A training sets the threads of torch itself, so that its result does not depend on this.
"""


@dataclasses.dataclass(frozen=True)
class Run:
    """One training: what it was told and where it works."""

    number: int
    """Place in the sweep, from 0."""
    overrides: tuple[str, ...]
    """Settings as on the command line."""
    folder: Path
    """Where it leaves everything."""

    @property
    def checkpoint(self) -> Path:
        """Its newest checkpoint."""
        return self.folder / "checkpoints" / "last.pt"

    @property
    def failure(self) -> Path:
        """Where the reason of a failure is kept."""
        return self.folder / "failure.json"

    def arguments(self) -> list[str]:
        """What to give to `drone-rl` to begin this run or to go on with it."""
        folder = quoted(str(self.folder))
        own = ["hydra.mode=RUN", f"hydra.run.dir={folder}"]
        resume = [f"resume={folder}"] if self.checkpoint.is_file() else []
        return ["train", *self.overrides, *own, *resume]

    def repeat_command(self) -> str:
        """The shell command that trains the same once more."""
        settings = [o for o in self.overrides if not o.startswith("trial=")]
        words = ["drone-rl", "train", *settings, "hydra.mode=RUN"]
        return shlex.join(words)


def read_result(folder: Path) -> dict[str, Any] | None:
    """`result.json` of a run that came to its own end; None of one that must go on."""
    try:
        content = read_bytes(folder / "result.json", RESULT_BYTES)
        result = dict(as_mapping(parse_json(content, "result", allow_nan=True), "result"))
        reason = Text(100).read(result.get("reason"), "reason")
    except InputError:
        return None
    return None if reason.startswith("SIG") else result


def read_failure(run: Run) -> str | None:
    """The error of a run that failed; None if it did not."""
    try:
        error = as_mapping(read_json(run.failure), "failure")["error"]
    except (InputError, KeyError):
        return None
    return "".join(c if c.isprintable() else " " for c in str(error)[:1000])


def quoted(value: str) -> str:
    """A value that Hydra's command line takes literally."""
    escaped = value.replace("\\", "\\\\").replace("'", "\\'")
    return f"'{escaped}'"
