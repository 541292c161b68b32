import math

import numpy as np
import pytest
import torch

from drone_rl.flight.commands.computer_vision import _attitude
from drone_rl.flight.commands.state import Collision, LandedState, PilotState
from drone_rl.sim.coordinates import Attitude, to_simulator
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


@pytest.mark.parametrize("pitch", [-90, 90])
@pytest.mark.parametrize(("roll", "yaw"), [(0, 30), (0, -120), (20, 50)])
def test_yaw_is_known_with_the_nose_straight_up_or_down(pitch, roll, yaw):
    """There yaw and roll turn about one axis, in opposite senses with the nose up."""
    turn = yaw - roll if pitch > 0 else yaw + roll
    quaternion = _attitude(*np.radians(to_simulator(roll, pitch, yaw)).tolist())
    found = Attitude.of(quaternion.tolist())
    assert (found.roll, found.pitch, found.yaw) == pytest.approx((0, pitch, turn), abs=1e-4)


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
