"""`drone-rl serve` until Ctrl-C, and its refusals."""

import re
import signal
import subprocess
import sys

import pytest

from tests.flight.airsim.conftest import Client


def start(tmp_path, *args):
    command = [sys.executable, "-m", "drone_rl.cli.main", "serve", f"hydra.run.dir={tmp_path}/run"]
    return subprocess.Popen(
        [*command, *args], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def test_it_says_when_clients_can_connect_and_ends_by_ctrl_c(tmp_path):
    process = start(tmp_path, "settings=none", "port=0", "scene=empty", "clock=lockstep")
    line = ""
    while "ready" not in line:
        line = process.stdout.readline()
        assert line, process.stderr.read()
    port = int(re.search(r"127\.0\.0\.1:(\d+)", line)[1])
    client = Client(port)
    assert client.call("ping") is True
    client.call("enableApiControl", True)
    assert client.call("takeoff", 20.0) is True
    process.send_signal(signal.SIGINT)
    printed, errors = process.communicate(timeout=60)
    assert process.returncode == 0, errors
    assert "Traceback" not in errors
    assert "3 calls: ping 1, enableApiControl 1, takeoff 1" in " ".join((printed + errors).split())
    client.close()


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (("scene=moon",), "scene=moon is unknown"),
        (("settings=none.json",), "none.json can't be read"),
        (("clock=fast",), "clock='fast' is unknown"),
    ],
)
def test_wrong_settings_are_one_line(in_process, args, message):
    done = in_process("serve", "port=0", *args)
    assert done.returncode == 2
    assert message in done.stderr and "Traceback" not in done.stderr
