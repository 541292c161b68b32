"""Lockstep gives the same states every run, whatever the pace of a client within its patience."""

import random
import time

import msgpack
import pytest

from drone_rl.flight.airsim.lockstep import MOST_REQUESTS, STEP
from tests.flight.airsim.conftest import YAW, Client

IMAGE = {"camera_name": "0", "image_type": 0, "pixels_as_float": False, "compress": False}
FAR = (90.0, 0.0, -2.0, 1.0, 600.0, 0, YAW, -1.0, 1.0, "")


def take_off(client):
    client.call("enableApiControl", True)
    assert client.call("takeoff", 20.0) is True


def velocity(client, seconds):
    return client.send("moveByVelocity", 2.0, 1.0, 0.0, seconds, 0, YAW, "")


def stamp(client):
    return client.call("getMultirotorState")["timestamp"] / 1e9


@pytest.fixture
def fly(start):
    """Return a function that runs a script which asks while movements wait, and its answers."""

    def run(pause):
        _, client = start(scene="cubes", seed=3, patience_s=0.3)
        take_off(client)
        found = []
        for i in range(4):
            movement = velocity(client, 0.5 + 0.1 * i)
            pause()
            found.append(client.call("getMultirotorState"))
            pause()
            found.append(client.call("simGetImages", [IMAGE], ""))
            pause()
            found.append(client.call("getImuData", "", ""))
            found.append(client.receive(movement))
            found.append(client.call("simGetGroundTruthKinematics", ""))
        return msgpack.packb(found)

    return run


def test_a_script_that_asks_while_it_moves_repeats(fly):
    draw = random.Random(0)
    first = fly(lambda: None)
    assert all(fly(lambda: None) == first for _ in range(3))
    assert fly(lambda: time.sleep(draw.uniform(0.0, 0.05))) == first


def test_what_is_asked_at_once_is_answered_at_the_start(start):
    _, client = start(patience_s=0.3)
    take_off(client)
    begin = stamp(client)
    movement = velocity(client, 2.0)
    assert stamp(client) == begin
    assert client.receive(movement) == (None, True)
    assert stamp(client) == pytest.approx(begin + 2.0, abs=0.05)


def test_loops_that_ask_go_on_and_end_at_the_same_time(start):
    def fly(pause):
        _, client = start(patience_s=0.3)
        take_off(client)
        begin, seen = stamp(client), []
        client.send("moveToPosition", *FAR)
        while True:
            state = client.call("getMultirotorState")
            seen.append(round(state["timestamp"] / 1e9 - begin, 6))
            if state["kinematics_estimated"]["position"]["x_val"] > 0.5:
                return seen, msgpack.packb(state)
            pause()

    seen, state = fly(lambda: None)
    assert seen[: MOST_REQUESTS - 1] == [0.0] * (MOST_REQUESTS - 1)
    assert STEP <= seen[MOST_REQUESTS] < STEP + 0.022
    assert fly(lambda: time.sleep(0.001)) == (seen, state)


def test_other_clients_are_served_while_a_call_never_ends(start):
    server, client = start(patience_s=0.0)
    take_off(client)
    client.send("moveToPosition", *FAR)
    other = Client(server.address[1])
    for _ in range(5):
        begin = time.monotonic()
        assert other.call("ping") is True
        assert time.monotonic() - begin < 5.0  # STRIDE simulated seconds take some 0.1 s
    assert other.call("simPause", True) is None
    one = stamp(other)
    time.sleep(0.05)
    assert stamp(other) == one
    other.close()


def test_a_watching_client_changes_nothing(start):
    def fly(watch):
        server, client = start(patience_s=0.3)
        take_off(client)
        other = Client(server.address[1])
        states = []
        for _ in range(3):
            movement = velocity(client, 0.5)
            if watch:
                for _ in range(3 * MOST_REQUESTS):
                    other.call("simGetVehiclePose")
            states.append(client.receive(movement))
            states.append(client.call("getMultirotorState"))
        other.close()
        return msgpack.packb(states)

    assert fly(watch=True) == fly(watch=False)
