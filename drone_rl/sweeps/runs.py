"""One run of a sweep, as its folder tells of it."""

import dataclasses
import json
import shlex
from pathlib import Path
from typing import Any

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
        result = json.loads((folder / "result.json").read_text())
    except (OSError, ValueError):
        return None
    reason = result.get("reason") if isinstance(result, dict) else None
    return None if not isinstance(reason, str) or reason.startswith("SIG") else result


def read_failure(run: Run) -> str | None:
    """The error of a run that failed; None if it did not."""
    try:
        return str(json.loads(run.failure.read_text())["error"])
    except (OSError, ValueError, KeyError, TypeError):
        return None


def quoted(value: str) -> str:
    """A value that Hydra's command line takes literally."""
    escaped = value.replace("\\", "\\\\").replace("'", "\\'")
    return f"'{escaped}'"
