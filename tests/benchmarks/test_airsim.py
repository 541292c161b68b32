"""The benchmark of the server: crafted messages, and what counts as survived."""

import random

import msgpack
import pytest

from benchmarks import airsim
from drone_rl.flight.airsim.methods import METHODS, UNSUPPORTED
from drone_rl.flight.airsim.serving import serve


def test_crafted_messages_are_of_all_kinds():
    draw = random.Random(0)
    made = [airsim._crafted(draw) for _ in range(300)]
    assert all(isinstance(one, bytes) and one for one in made)
    good = 0
    for one in made:
        try:
            good += isinstance(msgpack.unpackb(one, raw=False, strict_map_key=False), list)
        except Exception:
            continue
    assert 50 < good < 250


def test_survived_messages_are_counted():
    with serve(scene="empty", port=0, clock="lockstep") as server:
        assert airsim.fuzz(server.address[1], 300) == 300
        assert airsim._rate(server.address[1], 0.1, lambda p: p.call("ping")) > 10
        assert airsim._continued(server.address[1], 10, 0.01) == pytest.approx(0.1, abs=0.003)


def test_a_server_that_stops_answering_is_noticed():
    with serve(scene="empty", port=0) as server:
        peer = airsim.Peer(server.address[1])
        assert peer.call("ping") is True
        with pytest.raises(RuntimeError, match="could not find function"):
            peer.call("fly")
    with pytest.raises((RuntimeError, OSError)):
        peer.call("ping")


def test_every_method_of_the_client_is_accounted_for():
    unknown = airsim.METHODS_1_8 - METHODS.keys() - UNSUPPORTED.keys()
    assert unknown == set()


def test_methods_that_the_server_is_to_have():
    """Of 125 methods 28 need cars, lidar, distance sensors or Unreal."""
    assert len(airsim.METHODS_1_8) == 125
    wanted = airsim.asked_for()
    assert len(wanted) == 97
    assert not wanted & {"getLidarData", "getDistanceSensorData", "setCarControls", "simLoadLevel"}
    assert wanted - METHODS.keys() == {"simCreateVoxelGrid", "simGetWorldExtents"}
