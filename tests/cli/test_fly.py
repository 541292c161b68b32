"""`drone-rl fly` until Ctrl-C, and its refusals."""

import re
import signal
import subprocess
import sys
import urllib.request

import pytest

pytest.importorskip("uvicorn")


def start(tmp_path, *args):
    command = [sys.executable, "-m", "drone_rl.cli.main", "fly", f"hydra.run.dir={tmp_path}/run"]
    settings = [f"paths.outputs={tmp_path}", "saliency=false", "browser=false"]
    return subprocess.Popen(
        [*command, *settings, *args], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def test_it_prints_the_url_and_ends_by_ctrl_c(tmp_path):
    process = start(tmp_path, "policy=poor", "view=chase", "task.num_cubes=2")
    line = process.stdout.readline()
    assert line, process.stderr.read()
    url = re.fullmatch(r"open (http://127\.0\.0\.1:\d+/[\w-]{32}/)\n", line)[1]
    with urllib.request.urlopen(url, timeout=60) as answer:
        assert answer.status == 200
    process.send_signal(signal.SIGINT)
    assert process.wait(60) == 0, process.stderr.read()
    assert "Traceback" not in process.stderr.read()


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (("policy=none",), "policy=none does not exist"),
        (("dynamics.wind=[5,0,0]",), "moves nothing in computer-vision mode"),
    ],
)
def test_wrong_settings_are_one_line(in_process, args, message):
    done = in_process("fly", *args)
    assert done.returncode == 2
    assert message in done.stderr and "Traceback" not in done.stderr
