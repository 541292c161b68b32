"""`drone-rl` as a user runs it."""

import subprocess
import sys

TINY = ["experiment=smoke", "logger=csv", "trainer.total_frames=400", "collector.num_envs=4"]
"""A training of a second."""


def drone_rl(*args, cwd, **kwargs):
    command = [sys.executable, "-m", "drone_rl.cli.main", *map(str, args)]
    return subprocess.run(
        command, cwd=cwd, capture_output=True, text=True, check=False, timeout=300, **kwargs
    )


def error_line(done):
    """The one line that a mistake is worth."""
    lines = [line for line in done.stderr.splitlines() if line.startswith("error: ")]
    assert done.returncode != 0, done.stdout
    assert "Traceback" not in done.stderr, done.stderr
    assert len(lines) == 1, done.stderr
    return lines[0]
