"""`drone-rl` as a user runs it."""

from tests.forked import run_forked

TINY = ["experiment=smoke", "logger=csv", "trainer.total_frames=400", "collector.num_envs=4"]
"""A training of a second."""


def drone_rl(*args, cwd, stdout=None, setup=""):
    """Run a command in a process of its own, after the Python code `setup`."""
    code = f"{setup}\nfrom drone_rl.cli.main import main; main()"
    return run_forked(code, *args, cwd=cwd, stdout=stdout)


def error_line(done):
    """The one line that a mistake is worth."""
    lines = [line for line in done.stderr.splitlines() if line.startswith("error: ")]
    assert done.returncode != 0, done.stdout
    assert "Traceback" not in done.stderr, done.stderr
    assert len(lines) == 1, done.stderr
    return lines[0]
