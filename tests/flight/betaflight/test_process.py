"""Programs in a network of their own, which end with whoever started them."""

import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from drone_rl.flight.betaflight.process import FirmwareProcess, check_ports
from drone_rl.flight.in_the_loop.drone import FlightControllerError
from drone_rl.utils.errors import InputError

ECHO = """
import socket
s = socket.socket(type=socket.SOCK_DGRAM)
s.bind(("127.0.0.1", 9003))
s.sendto(s.recv(64)[::-1], ("127.0.0.1", 9002))
"""


def program(code):
    return [sys.executable, "-c", code]


@pytest.fixture
def process(own_network):
    with FirmwareProcess() as process:
        yield process


def test_sockets_connect_to_its_network(process, tmp_path):
    """Two have the same ports at the same time, in networks of their own."""
    with FirmwareProcess() as other:
        other.start(program("import time; time.sleep(60)"), tmp_path, tmp_path / "log")
        process.start(program(ECHO), tmp_path, tmp_path / "log")
        process.rotors.settimeout(0.05)
        for _ in range(200):
            try:
                process.state.send(b"abc")
                assert process.rotors.recv(64) == b"cba"
                break
            except (TimeoutError, ConnectionRefusedError):
                continue  # it is still starting
        else:
            pytest.fail("no echo")


def test_a_program_that_ends_is_not_waited_for(process, tmp_path):
    process.start(program("raise SystemExit(7)"), tmp_path, tmp_path / "log")
    with pytest.raises(FlightControllerError, match="ended with status 7"):
        process.connect(10.0)
    process.start(["/no/such/program"], tmp_path, tmp_path / "log")
    with pytest.raises(FlightControllerError, match="ended with status 1"):
        process.connect(10.0)


def test_one_that_answers_nobody_is_given_up_and_killed(process, tmp_path):
    code = "import signal, time; signal.signal(15, signal.SIG_IGN); print(1, flush=True); "
    process.start(program(code + "time.sleep(60)"), tmp_path, tmp_path / "log")
    with pytest.raises(FlightControllerError, match=r"can't connect: .*Connection refused"):
        process.connect(0.1)
    while not (tmp_path / "log").read_bytes():
        time.sleep(0.01)
    assert process.status() is None
    process.close()
    assert process.status() == -9


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="Linux")
def test_it_ends_with_the_program_that_started_it(own_network, tmp_path):
    code = f"""
import pathlib, sys, time
from drone_rl.flight.betaflight.process import FirmwareProcess
folder = pathlib.Path({str(tmp_path)!r})
sleep = "import os, time; print(os.getpid(), flush=True); time.sleep(60)"
FirmwareProcess().start([sys.executable, "-c", sleep], folder, folder / "log")
time.sleep(60)
"""
    with subprocess.Popen(program(code)) as parent:
        while not (pid := (tmp_path / "log").read_text() if (tmp_path / "log").exists() else ""):
            time.sleep(0.02)
        parent.kill()
    status = Path(f"/proc/{pid.strip()}/stat")
    end = time.monotonic() + 10.0
    while status.exists() and status.read_text().split(")")[1].split()[0] != "Z":
        assert time.monotonic() < end
        time.sleep(0.01)


def test_ports_that_are_taken_are_named(tmp_path):
    with socket.socket(type=socket.SOCK_DGRAM) as sock:
        try:
            sock.bind(("0.0.0.0", 9003))
        except OSError:
            pytest.skip("port 9003 is in use")
        with pytest.raises(InputError, match="port 9003 is taken"):
            check_ports()
        with pytest.raises(InputError, match="port 9003 is taken"):
            FirmwareProcess(isolated=False).start(["/bin/true"], tmp_path, tmp_path / "log")
