"""What the page shows of AirSim's server, and the one thing that browsers can choose."""

import asyncio
import io
import json
import struct
import threading

import pytest
from PIL import Image

from drone_rl.flight.airsim.settings_file import parse_settings
from drone_rl.flight.airsim.simulation import Simulation
from drone_rl.flight.fly_page.watch import Watched
from drone_rl.flight.settings import CAMERAS, ServeSettings
from drone_rl.utils.errors import InputError


@pytest.fixture(scope="module")
def simulation():
    made = Simulation(parse_settings("{}"), ServeSettings(scene="blocks", clock="lockstep"))
    yield made
    made.close()


@pytest.fixture
def loop():
    made = asyncio.new_event_loop()
    thread = threading.Thread(target=made.run_forever)
    thread.start()
    yield made
    made.call_soon_threadsafe(made.stop)
    thread.join()
    made.close()


def parts(frame):
    (size,) = struct.unpack("<I", frame[:4])
    state = json.loads(frame[4 : 4 + size])
    return state, Image.open(io.BytesIO(frame[4 + size :]))


def test_frames_show_the_vehicle_and_change_nothing(simulation, loop):
    watched = Watched(simulation, loop)
    before = simulation.time, simulation.find("").multirotor_state()
    assert "blocks" in watched.hello()["texts"]["task"]
    images = {}
    for camera in CAMERAS:
        watched.handle({"type": "camera", "camera": camera})
        state, image = parts(watched.frame())
        assert state["camera"] == camera
        images[camera] = image.tobytes()
    assert len({*images.values()}) == len(CAMERAS)
    assert state["position"][:2] == [0.0, 0.0] and "SimpleFlight" in state["texts"]["flyer"]
    assert [6.0, -4.0, 1.0] in state["objects"]  # the orange ball
    assert (simulation.time, simulation.find("").multirotor_state()) == before


def test_browsers_can_choose_only_a_camera(simulation, loop):
    watched = Watched(simulation, loop)
    for message in (
        {"type": "camera", "camera": "none"},
        {"type": "reset"},
        {"type": "hold", "controls": ["forward"]},
        None,
    ):
        with pytest.raises(InputError):
            watched.handle(message)


def test_there_is_no_frame_after_the_server_has_ended(simulation):
    ended = asyncio.new_event_loop()
    ended.close()
    assert Watched(simulation, ended).frame() == b""
