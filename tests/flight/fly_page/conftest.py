"""Worlds, flights and pages of the shipped policies, and a reader of frames."""

import json
import struct

import pytest

import drone_rl
from drone_rl.flight.fly_page.flight import Flight
from drone_rl.flight.fly_page.world import World
from drone_rl.flight.settings import FlySettings


def decode(frame):
    """Split a frame into its state and its images by name."""
    (size,) = struct.unpack("<I", frame[:4])
    state, at, images = json.loads(frame[4 : 4 + size]), 4 + size, {}
    for part in state["images"]:
        images[part["name"]] = frame[at : at + part["size"]]
        at += part["size"]
    assert at == len(frame)
    return state, images


@pytest.fixture
def make_world():
    """Return a factory of worlds of a policy, by default the shipped good one."""
    made = []

    def build(policy="good", **changes):
        found = drone_rl.load_policy(policy) if isinstance(policy, str) else policy
        made.append(World(found, **changes))
        return made[-1]

    yield build
    for world in made:
        world.close()


@pytest.fixture
def make_flight(tmp_path):
    """Return a factory of flights, without heat maps; see `make_world`."""
    made = []

    def build(policy="good", **changes):
        settings = FlySettings(saliency=False).replace(**changes)
        made.append(Flight(drone_rl.load_policy(policy), settings, tmp_path / "demonstrations"))
        return made[-1]

    yield build
    for flight in made:
        flight.close()
