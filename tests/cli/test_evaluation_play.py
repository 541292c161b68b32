"""Films, and the viewer that needs a display."""

import os
import sys

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


def test_play_records_for_rerun(run, in_process):
    pytest.importorskip("rerun", reason="rerun isn't installed: extra [rerun]")
    done = in_process(
        "play", f"policy={run}", "episodes=2", "format=rerun", "hydra.run.dir=r", cwd=run
    )
    assert done.returncode == 0, done.stderr
    assert {p.name for p in (run / "r").glob("episode_*")} == {"episode_0.rrd", "episode_1.rrd"}


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (["format=mp4"], ["format='mp4'", "video, rerun"]),
        (["format=rerun", "viewer=true"], ["format=rerun", "viewer=true", "leave"]),
        (["format=rerun", "episodes=0"], ["episodes=0", "1 or more"]),
    ],
)
def test_mistakes_get_one_line(in_process, settings, words):
    line = error_line(in_process("play", "policy=good", *settings))
    assert all(word in line for word in words), line


def test_play_names_a_missing_extra(in_process, monkeypatch):
    monkeypatch.setitem(sys.modules, "rerun", None)
    line = error_line(in_process("play", "policy=good", "format=rerun"))
    assert "format=rerun needs rerun" in line and "pip install -e '.[rerun]'" in line
