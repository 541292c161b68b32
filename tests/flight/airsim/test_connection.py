"""The protocol byte by byte, crafted bytes, and clients that read slowly or die."""

import socket
import time

import msgpack
import pytest

from tests.flight.airsim.conftest import CV, YAW, Client

PING = bytes([0x94, 0x00, 0x00, 0xA4, *b"ping", 0x90])
PONG = bytes([0x94, 0x01, 0x00, 0xC0, 0xC3])


def test_first_message_of_real_clients(start):
    server, _ = start()
    with socket.create_connection(server.address, timeout=10) as raw:
        for byte in PING:  # in pieces
            raw.sendall(bytes([byte]))
        assert raw.recv(100) == PONG
        raw.sendall(PING + PING)
        answer = b""
        while len(answer) < 10:
            answer += raw.recv(100)
        assert answer == PONG + PONG


def test_errors_have_the_words_of_airsim(start):
    _, client = start()
    error, _ = client.receive(client.send("fly"))
    assert error.startswith("rpclib: server could not find function 'fly' with argument count 0.")
    error, _ = client.receive(client.send("getMultirotorState", "Drone2"))
    assert error.startswith(
        "rpclib: function 'getMultirotorState' (called with 1 arg(s)) threw an exception. The "
        "exception contained this information: Vehicle API for 'Drone2' is not available."
    )
    error, _ = client.receive(client.send("getLidarData", "", ""))
    assert "getLidarData is not supported: this server has no lidar, " in error
    error, _ = client.receive(client.send("moveToZ", 1.0))
    assert "moveToZ was called with 1 arguments; give 2 or more" in error
    assert client.call("ping") is True


@pytest.mark.parametrize(
    "data",
    [
        b"\xc1",  # no msgpack
        msgpack.packb(7),
        msgpack.packb([]),
        msgpack.packb([5, 1, "ping", []]),
        msgpack.packb([0, 1, 7, []]),
        msgpack.packb([0, 1, "ping", 7]),
        msgpack.packb([0, "1", "ping", []]),
        b"\x91" * 5000,  # nested
        b"\xdd\xff\xff\xff\xff",  # 4 billion items
        b"\xc6\xff\xff\xff\xff",  # 4 GB
    ],
)
def test_crafted_bytes_end_the_connection_alone(start, data):
    server, client = start(CV)
    with socket.create_connection(server.address, timeout=10) as raw:
        raw.sendall(data)
        raw.settimeout(1.0)
        try:
            ended = raw.recv(100) == b""
        except (TimeoutError, ConnectionResetError) as error:
            # a length that has not arrived yet may also leave the connection open
            ended = isinstance(error, ConnectionResetError) or data[0] == 0xC6
        assert ended
    assert client.call("ping") is True


def test_a_result_that_can_not_be_packed_is_an_error_of_its_call(start):
    _, client = start('{"Vehicles": {"\\ud800": {}}}')  # half of a letter
    error, _ = client.receive(client.send("listVehicles"))
    assert error == "rpclib: function 'listVehicles' failed: UnicodeEncodeError."
    assert client.call("ping") is True


def test_notifications_are_not_answered(start):
    _, client = start(CV)
    client.socket.sendall(msgpack.packb([2, "ping", []]))
    assert client.call("ping") is True
    assert client.answers == {}


def test_a_slow_reader_delays_itself_alone(start):
    server, client = start(CV)
    slow = Client(server.address[1])
    request = {"camera_name": "0", "image_type": 0, "pixels_as_float": True, "compress": False}
    for _ in range(300):
        slow.send("simGetImages", [request], "")
    begin = time.monotonic()
    assert client.call("ping") is True
    assert time.monotonic() - begin < 30
    slow.close()


def test_a_second_request_comes_at_once(start):
    """Without `TCP_QUICKACK` the client's system would hold it back for some 40 ms."""
    _, client = start(patience_s=0.1)
    client.call("enableApiControl", True)
    client.call("takeoff", 20.0)
    seconds = []
    for _ in range(9):
        movement = client.send("moveByVelocity", 0.0, 0.0, 0.0, 0.1, 0, YAW, "")
        begin = time.monotonic()
        client.call("ping")
        seconds.append(time.monotonic() - begin)
        client.receive(movement)
    assert sorted(seconds)[4] < 0.03


def test_a_client_that_dies_in_a_call_is_forgotten(start):
    server, client = start()
    client.call("enableApiControl", True)
    client.send("takeoff", 20.0)
    client.close()
    again = Client(server.address[1])
    again.call("simContinueForTime", 5.0)
    assert again.call("getMultirotorState")["landed_state"] == 1
    again.close()
