"""Films, and the viewer that needs a display."""

import os

import pytest

from tests.cli.running import error_line


@pytest.mark.skipif("DISPLAY" in os.environ, reason="there is a display")
def test_viewer_without_a_display(run, in_process):
    line = error_line(in_process("play", f"checkpoint={run}", "viewer=true", cwd=run))
    assert "needs a display" in line


def test_play_films(run, in_process):
    args = ["play", f"checkpoint={run}", "episodes=1", "appearance=blocks", "hydra.run.dir=films"]
    done = in_process(*args, cwd=run)
    assert done.returncode == 0, done.stderr
    assert {p.name for p in (run / "films").glob("episode_0.*")} == {
        "episode_0.mp4",
        "episode_0.gif",
    }
