"""Settings and refusals of a server in a thread."""

import pytest

from drone_rl.flight.airsim.serving import serve
from drone_rl.utils.errors import InputError


def test_a_host_that_is_no_name_is_one_error():
    with pytest.raises(InputError, match=r"port=0 of address='aaaa.* can't be opened"):
        serve(scene="empty", port=0, address="a" * 70)


def test_a_port_in_use_is_one_error():
    with (
        serve(scene="empty", port=0) as server,
        pytest.raises(InputError, match=r"port=\d+ of address='127.0.0.1' can't be opened"),
    ):
        serve(scene="empty", port=server.address[1])


def test_calls_that_wait_when_the_server_stops_are_answered_with_an_error(start):
    server, client = start(patience_s=60.0)
    client.call("enableApiControl", True)
    movement = client.send("takeoff", 20.0)
    client.call("ping")
    server.close()
    error, _ = client.receive(movement)
    assert error == "the server has stopped; connect again"
    with pytest.raises(ConnectionError):
        client.receive(movement)


def test_an_open_address_is_warned_about(caplog):
    with serve(scene="empty", port=0, address="0.0.0.0"):
        assert "everybody in that network can control the vehicles" in caplog.text


def test_a_scene_may_be_a_path(tmp_path):
    file = tmp_path / "box.xml"
    file.write_text('<mujoco><worldbody><geom type="box" size="1 1 1"/></worldbody></mujoco>')
    with serve(scene=file, port=0) as server:
        assert server.simulation.stage.scene_name == str(file)
