import math

import pytest
import torch

from drone_rl.flight.commands.state import Attitude, Collision, LandedState, PilotState
from drone_rl.sim.dynamics.state import DEPTH, GROUND, NORMAL, THING

HALF = math.sqrt(0.5)


@pytest.mark.parametrize(
    ("quaternion", "angles"),
    [
        ((1, 0, 0, 0), (0, 0, 0)),
        ((HALF, HALF, 0, 0), (90, 0, 0)),
        ((math.cos(0.25), 0, math.sin(0.25), 0), (0, -math.degrees(0.5), 0)),
        ((HALF, 0, 0, HALF), (0, 0, -90)),
        ((HALF, 0, -HALF, 0), (0, 90, 0)),
        ((0.5, 0.5, -0.5, 0.5), (0, 90, -90)),  # nose up, turned to the left
        ((0, -HALF, 0, HALF), (0, -90, -180)),
        ((0.5, -0.5, 0.5, 0.5), (0, -90, -90)),
    ],
)
def test_angles(quaternion, angles):
    found = Attitude.of(quaternion)
    assert (found.roll, found.pitch, found.yaw) == pytest.approx(angles, abs=1e-6)


def test_contacts_have_names(hovering):
    body = hovering((0, 0, 1))
    assert Collision.of(body) is None
    body.numbers[0, THING] = GROUND
    body.numbers[0, NORMAL : NORMAL + 3] = torch.tensor([0.0, 0.0, 1.0]).double()
    body.numbers[0, DEPTH] = 0.25
    touched = Collision.of(body)
    assert (touched.thing, touched.normal, touched.depth) == ("ground", (0, 0, 1), 0.25)
    body.numbers[0, THING] = 3
    assert Collision.of(body).thing == "obstacle 3"


def test_speed():
    state = PilotState(
        0.0, (0, 0, 0), (2, 3, 6), Attitude(0, 0, 0), LandedState.FLYING, True, False, None
    )
    assert state.speed == 7.0
