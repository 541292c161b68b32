"""A client of raw sockets, and servers in threads."""

import socket

import msgpack
import pytest

from drone_rl.flight.airsim.serving import serve
from drone_rl.flight.airsim.stage import Stage

CV = '{"SimMode": "ComputerVision"}'
SMALL = """{"SimMode": "ComputerVision", "CameraDefaults": {"CaptureSettings": [
  {"ImageType": -1, "Width": 16, "Height": 8, "FOV_Degrees": 90}]}}"""
NAN = float("nan")
LEVEL = {"w_val": 1.0, "x_val": 0.0, "y_val": 0.0, "z_val": 0.0}
YAW = {"is_rate": True, "yaw_or_rate": 0.0}


def pose(x, y, z, orientation=LEVEL):
    return {"position": {"x_val": x, "y_val": y, "z_val": z}, "orientation": orientation}


def request(camera="0", kind=0, *, as_float=False, compress=False, **more):
    given = {"image_type": kind, "pixels_as_float": as_float, "compress": compress}
    return {"camera_name": camera, **given, **more}


class Client:
    """Speaks msgpack-rpc; `call` waits for the answer, `send` and `receive` do not."""

    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=60)
        self.unpacker = msgpack.Unpacker(raw=False, strict_map_key=False)
        self.number = 0
        self.answers = {}

    def send(self, method, *args):
        self.number += 1
        self.socket.sendall(msgpack.packb([0, self.number, method, args]))
        return self.number

    def receive(self, number):
        while number not in self.answers:
            data = self.socket.recv(2**20)
            if not data:
                raise ConnectionError("the server has closed the connection")
            self.unpacker.feed(data)
            for kind, answered, error, result in self.unpacker:
                assert kind == 1
                self.answers[answered] = (error, result)
        return self.answers.pop(number)

    def call(self, method, *args):
        error, result = self.receive(self.send(method, *args))
        if error is not None:
            raise RuntimeError(error)
        return result

    def close(self):
        self.socket.close()


@pytest.fixture(scope="module")
def cubes():
    stage = Stage("cubes", 0)
    yield stage
    stage.close()


@pytest.fixture(scope="module")
def empty():
    stage = Stage("empty", 0)
    yield stage
    stage.close()


@pytest.fixture
def start(tmp_path):
    """Return a function that starts a server and returns it with a client."""
    open_ones = []

    def run(text=None, **settings):
        path = None
        if text is not None:
            path = tmp_path / "settings.json"
            path.write_text(text)
        given = {"clock": "lockstep", "scene": "empty", "port": 0, **settings}
        server = serve(path, **given)
        client = Client(server.address[1])
        open_ones.extend([client, server])
        return server, client

    yield run
    for one in open_ones:
        one.close()
