import os
import signal
import socket
import sys

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


def test_sockets_connect_to_its_network(own_network, tmp_path):
    with FirmwareProcess() as process:
        hear = process.connect("bound", 9002)
        hear.settimeout(0.05)
        process.start([sys.executable, "-c", ECHO], tmp_path, tmp_path / "log")
        said = process.connect("udp", 9003)
        for _ in range(200):
            try:
                said.send(b"abc")
                assert hear.recv(64) == b"cba"
                break
            except (TimeoutError, ConnectionRefusedError):
                continue  # it is still starting
        else:
            pytest.fail("no echo")
        hear.close()
        said.close()


def test_a_program_that_ends_is_not_waited_for(own_network, tmp_path):
    with FirmwareProcess() as process:
        process.start([sys.executable, "-c", "raise SystemExit(7)"], tmp_path, tmp_path / "log")
        with pytest.raises(FlightControllerError, match="ended with status 7"):
            process.connect_within("tcp", 5761, 10.0)


def test_one_that_answers_nobody_is_given_up(own_network, tmp_path):
    with FirmwareProcess() as process:
        program = [sys.executable, "-c", "import time; time.sleep(60)"]
        process.start(program, tmp_path, tmp_path / "log")
        with pytest.raises(FlightControllerError, match=r"can't connect: .*Connection refused"):
            process.connect_within("tcp", 5761, 0.1)
        assert process.status() is None


def test_a_supervisor_that_is_gone(tmp_path):
    process = (
        FirmwareProcess(isolated=True) if sys.platform.startswith("linux") else pytest.skip("Linux")
    )
    process._process.kill()
    process._process.wait()
    with pytest.raises(FlightControllerError, match="supervisor is gone"):
        process.status()
    process.close()


def test_a_late_answer_is_not_that_of_the_next_request(own_network, tmp_path):
    with FirmwareProcess(patience=5.0) as process:
        process._link.settimeout(0.1)
        os.kill(process._process.pid, signal.SIGSTOP)
        with pytest.raises(FlightControllerError, match="doesn't answer"):
            process.start([sys.executable, "-c", ""], tmp_path, tmp_path / "log")
        os.kill(process._process.pid, signal.SIGCONT)
        with pytest.raises(FlightControllerError, match="supervisor is gone"):
            process.status()


def test_ports_that_are_taken_are_named():
    with socket.socket(type=socket.SOCK_DGRAM) as sock:
        try:
            sock.bind(("0.0.0.0", 9003))
        except OSError:
            pytest.skip("port 9003 is in use")
        with pytest.raises(InputError, match="port 9003 is taken"):
            check_ports()
        with pytest.raises(InputError, match="port 9003 is taken"):
            FirmwareProcess(isolated=False)
