"""`drone-rl serve` until Ctrl-C."""

import re
import signal

from tests.cli.running import server
from tests.flight.airsim.conftest import Client


def test_it_says_when_clients_can_connect_and_ends_by_ctrl_c(tmp_path):
    settings = ["settings=none", "port=0", "scene=empty", "clock=lockstep"]
    with server("serve", *settings, cwd=tmp_path) as process:
        line = ""
        while "ready" not in line:
            line = process.stdout.readline()
            assert line, process.stderr.read()
        client = Client(int(re.search(r"127\.0\.0\.1:(\d+)", line)[1]))
        assert client.call("ping") is True
        client.call("enableApiControl", True)
        assert client.call("takeoff", 20.0) is True
        process.send_signal(signal.SIGINT)
        printed, errors = process.communicate(timeout=120)
    assert process.returncode == 0, errors
    assert "Traceback" not in errors
    assert "3 calls: ping 1, enableApiControl 1, takeoff 1" in " ".join((printed + errors).split())
    client.close()
