"""Brings one run to its end in a process of its own, wherever that process lives."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from drone_rl.sweeps.runs import THREADS, Run, read_result
from drone_rl.utils.files import is_locked, read_tail, write_atomically
from drone_rl.utils.limits import LOG_BYTES

PROGRAM = (sys.executable, "-m", "drone_rl.cli.main")
"""What a run is started with."""
POLL_S = 0.1
"""Time between two looks at a process."""


class RunProcess:
    """Starts a run, goes on with a half-finished one, leaves a finished one alone.

    A run that a process of a killed sweep is still busy with is waited for: its work counts.
    """

    def __init__(self, run: Run) -> None:
        """Takes a run; nothing is started before the first `poll`."""
        self.run = run
        self._process: subprocess.Popen | None = None

    def poll(self) -> int | None:
        """The exit status, or None as long as there is none."""
        if self._process is None:
            if is_locked(self.run.folder):
                return None
            if read_result(self.run.folder) is not None:
                return 0
            self._process = self._start()
        status = self._process.poll()
        if not status:
            return status
        if is_locked(self.run.folder) or read_result(self.run.folder) is not None:
            self._process = None  # one that an earlier sweep had started was quicker: it counts
            return None
        self._note_failure(status)
        return status

    def wait(self) -> int:
        """Polls until there is an exit status."""
        while (status := self.poll()) is None:
            time.sleep(POLL_S)
        return status

    def stop(self) -> None:
        """Lets the run save its state and end."""
        if self._process is not None and self._process.poll() is None:
            self._process.send_signal(signal.SIGTERM)
            self._process.wait()

    def _start(self) -> subprocess.Popen:
        self.run.folder.mkdir(parents=True, exist_ok=True)
        self.run.failure.unlink(missing_ok=True)
        with self._log.open("ab") as log:
            return subprocess.Popen(
                [*PROGRAM, *self.run.arguments()],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                env={**os.environ, **THREADS},
                start_new_session=True,  # Ctrl-C is for the sweep, which then stops its runs
            )

    @property
    def _log(self) -> Path:
        return self.run.folder / "output.log"

    def _note_failure(self, status: int) -> None:
        tail = read_tail(self._log, LOG_BYTES).decode(errors="replace").splitlines()
        note_failure(self.run, _error(tail, status))


def note_failure(run: Run, error: str) -> None:
    """Keeps the reason of a failure in the run's folder."""
    run.folder.mkdir(parents=True, exist_ok=True)
    write_atomically(run.failure, json.dumps({"error": error}, indent=2))


def finish_run(run: Run) -> int:
    """Brings a run to its end. Returns the exit status."""
    return RunProcess(run).wait()


def _error(lines: list[str], status: int) -> str:
    """The line of a log that says why a run failed."""
    if status < 0:
        return f"ended by signal {signal.Signals(-status).name}"
    reasons = [line.removeprefix("error: ") for line in lines if line.startswith("error: ")]
    words = reasons or [line for line in lines if line.strip()]
    return words[-1].strip() if words else f"ended with status {status}"
