"""`drone-rl fly` until Ctrl-C."""

import re
import signal
import urllib.request

import pytest

from tests.cli.running import server

pytest.importorskip("websockets")


def test_it_prints_the_url_and_ends_by_ctrl_c(tmp_path):
    settings = ["policy=poor", "view=chase", "task.num_cubes=2", "saliency=false", "browser=false"]
    with server("fly", *settings, cwd=tmp_path) as process:
        line = process.stdout.readline()
        assert line, process.stderr.read()
        url = re.fullmatch(r"open (http://127\.0\.0\.1:\d+/[\w-]{32}/)\n", line)[1]
        with urllib.request.urlopen(url, timeout=120) as answer:
            assert answer.status == 200
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=120)
    assert process.returncode == 0, errors
    assert "Traceback" not in errors
