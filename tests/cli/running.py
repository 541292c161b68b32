"""`drone-rl` as a user runs it."""

import contextlib
import signal
import subprocess
import sys

import pytest

from drone_rl.cli.main import main
from tests.forked import run_forked

TINY = ["experiment=smoke", "logger=csv", "trainer.total_frames=400", "collector.num_envs=4"]
"""A training of a second."""


def drone_rl(*args, cwd, stdout=None, setup=""):
    """Run a command in a process of its own, after the Python code `setup`."""
    code = f"{setup}\nfrom drone_rl.cli.main import main; main()"
    return run_forked(code, *args, cwd=cwd, stdout=stdout)


def run_main(folder, *args):
    """Run a command of this process in a folder; return what it gives to `sys.exit`."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setattr(sys, "argv", ["drone-rl", *map(str, args)])
        with pytest.raises(SystemExit) as stop:
            main()
    return stop.value.code


@contextlib.contextmanager
def server(*args, cwd):
    """Start a command that runs until Ctrl-C; kill it if it outlives the test."""
    process = subprocess.Popen(
        [sys.executable, "-m", "drone_rl.cli.main", *args],
        cwd=cwd,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # nohup and a shell's & ignore Ctrl-C, also in the processes that the tests start
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def error_line(done):
    """The one line that a mistake is worth."""
    lines = [line for line in done.stderr.splitlines() if line.startswith("error: ")]
    assert done.returncode != 0, done.stdout
    assert "Traceback" not in done.stderr, done.stderr
    assert len(lines) == 1, done.stderr
    return lines[0]
