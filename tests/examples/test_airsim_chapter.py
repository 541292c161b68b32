"""Runs the chapter's program against servers: the oracle in all modes, a short training."""

from pathlib import Path

import pytest

from drone_rl.flight.airsim.serving import serve

PATH = Path(__file__).parents[2] / "examples" / "airsim_chapter.py"


@pytest.fixture
def connect(example, tmp_path):
    """Return a function that starts a server and returns an environment of the program."""
    open_ones = []

    def run(clock="lockstep", mode="Multirotor", *, ignore_collision=True):
        path = tmp_path / "settings.json"
        path.write_text(example.SETTINGS[mode])
        server = serve(path, clock=clock, port=0)
        client = example.Client(server.address[1])
        open_ones.extend([client, server])
        return example.ChapterEnv(client, ignore_collision=ignore_collision)

    yield run
    for one in open_ones:
        one.close()


@pytest.mark.parametrize(
    ("clock", "mode", "ignore_collision"),
    [
        ("wall", "Multirotor", True),
        ("lockstep", "Multirotor", True),
        ("lockstep", "Multirotor", False),
        ("wall", "ComputerVision", True),
    ],
)
def test_an_oracle_collects_all_cubes(example, connect, clock, mode, ignore_collision):
    env = connect(clock, mode, ignore_collision=ignore_collision)
    assert example.fly(env, example.oracle, 2) == [3, 3]


@pytest.mark.parametrize(("action", "steps"), [(0, 45), (1, 27)])
def test_an_episode_ends_outside(example, connect, action, steps):
    """After 44 m ahead, or 26 m to a side, of which no cube is hit to the left."""
    env = connect()
    example.fly(env, lambda image: action, 1)
    assert env.steps == steps
    assert action == 0 or env.cubes == 0


def test_the_messages_are_those_of_version_1_1(example):
    """Strings and bytes have the old raw type, floats 64 bits; the first number is 0."""
    sent = []

    class Socket:
        def sendall(self, data):
            sent.append(data)

        def recv(self, most):
            return b"\x94\x01\x00\xc0\xc0"

    client = example.Client.__new__(example.Client)
    client._socket, client._number = Socket(), -1
    client._unpacker = example.msgpack.Unpacker(raw=True)
    client.simSetPose({"position": {"x_val": 1.0}}, True)
    (message,) = sent
    assert message[:14] == b"\x94\x00\x00\xaasimSetPose"
    assert message[14:25] == b"\x92\x81\xa8position"
    assert message[25:] == b"\x81\xa5x_val\xcb\x3f\xf0" + 6 * b"\x00" + b"\xc3"


def test_a_short_training_acts(example, connect):
    env = connect(mode="ComputerVision")
    act = example.train(env, batches=1, frames=400)
    assert act(env.reset()) in range(3)
