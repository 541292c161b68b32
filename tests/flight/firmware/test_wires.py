import os
import pty
import socket

import pytest

from drone_rl.flight.firmware.errors import LoopError
from drone_rl.flight.firmware.wires import SerialWire, TcpWire
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


def test_serial_wires_change_no_byte(terminal):
    far, name = terminal
    wire = SerialWire(name)
    every = bytes(range(256))
    wire.write(every)
    assert os.read(far, 1024) == every
    os.write(far, every)
    assert wire.read(5.0) == every
    assert wire.read(0.0) == b""
    wire.close()


def test_a_serial_wire_that_is_full(terminal):
    far, name = terminal
    wire = SerialWire(name, patience=0.1)
    with pytest.raises(LoopError, match="takes no more bytes"):
        wire.write(b"x" * 1_000_000)
    wire.close()
    assert os.read(far, 1)


def test_serial_ports_that_are_none(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="isn't there"):
        SerialWire(str(tmp_path / "none"))
    with pytest.raises(InputError, match="is no serial port"):
        SerialWire(str(tmp_path / "file"))
    with pytest.raises(InputError, match="baud=12345 is no speed"):
        SerialWire(str(tmp_path / "file"), baud=12345)
    with pytest.raises(InputError, match="can't be opened"):
        SerialWire(str(tmp_path))


def test_tcp_wires():
    wire = TcpWire(0)
    with pytest.raises(LoopError, match="call accept first"):
        wire.read(0.0)
    with pytest.raises(LoopError, match=r"no autopilot connected to port \d+ in 0.01 s"):
        wire.accept(0.01)
    with socket.create_connection(("127.0.0.1", wire.port)) as far:
        wire.accept(5.0)
        wire.write(b"abc")
        assert far.recv(16) == b"abc"
        assert wire.read(0.0) == b""
        far.sendall(b"def")
        assert wire.read(5.0) == b"def"
    with pytest.raises(LoopError, match="closed its connection"):
        wire.read(5.0)
    wire.close()


def test_ports_that_are_taken():
    wire = TcpWire(0)
    with pytest.raises(InputError, match=f"port={wire.port} can't be listened at"):
        TcpWire(wire.port)
    with pytest.raises(InputError, match="port=70000"):
        TcpWire(70000)
    wire.close()
