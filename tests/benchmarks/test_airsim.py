"""The benchmark of the server: crafted messages, and what counts as survived."""

import pytest

from benchmarks import airsim
from drone_rl.flight.airsim.methods import METHODS, UNSUPPORTED
from drone_rl.flight.airsim.serving import serve


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
