import os
import pty
import socket

import pytest

from drone_rl.flight.in_the_loop.drone import FlightControllerError
from drone_rl.flight.mavlink import SerialLink, TcpLink
from drone_rl.utils.errors import InputError


@pytest.fixture
def terminal():
    far, near = pty.openpty()
    yield far, os.ttyname(near)
    for number in (far, near):
        try:
            os.close(number)
        except OSError:
            continue


def test_serial_links_change_no_byte(terminal):
    far, name = terminal
    link = SerialLink(name)
    assert link.patience == 1.0
    every = bytes(range(256))
    link.write(every)
    assert os.read(far, 1024) == every
    os.write(far, every)
    assert link.read(5.0) == every
    assert link.read(0.0) == b""
    link.close()


def test_a_serial_link_that_is_full(terminal):
    far, name = terminal
    link = SerialLink(name, patience=0.1)
    with pytest.raises(FlightControllerError, match="accepts no more bytes"):
        link.write(b"x" * 1_000_000)
    link.close()
    assert os.read(far, 1)


def test_serial_ports_that_are_none(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="doesn't exist"):
        SerialLink(str(tmp_path / "none"))
    with pytest.raises(InputError, match="is no serial port"):
        SerialLink(str(tmp_path / "file"))
    with pytest.raises(InputError, match="baud=12345 is no serial speed"):
        SerialLink(str(tmp_path / "file"), baud=12345)
    with pytest.raises(InputError, match="baud=0 is no serial speed"):
        SerialLink(str(tmp_path / "file"), baud=0)
    with pytest.raises(InputError, match="can't be opened"):
        SerialLink(str(tmp_path))


def test_tcp_links():
    link = TcpLink(0)
    with pytest.raises(FlightControllerError, match="call accept first"):
        link.read(0.0)
    with pytest.raises(
        FlightControllerError, match=r"no autopilot connected to port \d+ in 0.01 s"
    ):
        link.accept(0.01)
    with pytest.raises(FlightControllerError, match="no autopilot connected"):
        link.accept(0.0)
    with socket.create_connection(("127.0.0.1", link.port)) as far:
        link.accept(5.0)
        link.write(b"abc")
        assert far.recv(16) == b"abc"
        assert link.read(0.0) == b""
        far.sendall(b"def")
        assert link.read(5.0) == b"def"
    with pytest.raises(FlightControllerError, match="the autopilot is gone"):
        link.read(5.0)
    link.close()


def test_ports_that_are_taken():
    link = TcpLink(0)
    with pytest.raises(InputError, match=f"can't listen at port={link.port}"):
        TcpLink(link.port)
    with pytest.raises(InputError, match="port=70000"):
        TcpLink(70000)
    with pytest.raises(InputError, match=r"host=192\.0\.2\.1.* give another port or host"):
        TcpLink(0, "192.0.2.1")  # of no machine
    link.close()
