import math

import pytest
import torch

from drone_rl.config import ActionSettings
from drone_rl.sim.dynamics import Kinematic
from drone_rl.sim.dynamics.state import heading_of

SETTINGS = ActionSettings(kind="velocity", forward_speed=4, sideways_speed=3, yaw_rate=90)


def flown(*actions, timestep=0.1):
    dynamics = Kinematic(SETTINGS, timestep)
    body = dynamics.start(torch.tensor([[1.0, 2.0, 3.0]], dtype=torch.float64))
    for action in actions:
        body = dynamics.step(body, torch.tensor([action], dtype=torch.float32))
    return body


def test_step_length_follows_from_the_velocity():
    body = flown((0.0, 0.5, 0.0))
    assert body.position[0].tolist() == pytest.approx([1.2, 2.15, 3.0])  # 2 and 1.5 m/s
    assert body.velocity[0].tolist() == pytest.approx([2.0, 1.5, 0.0])
    assert body.attitude.tolist() == [[1, 0, 0, 0]]
    assert flown((-1.0, 0.0, 0.0)).position.tolist() == [[1.0, 2.0, 3.0]]
    assert flown((1.0, 0.0, 0.0), timestep=0.5).position[0, 0] == 3.0


def test_turn_takes_effect_in_the_next_step():
    """1 s at 90 degrees/s, then 4 m/s forward, which is world left, and left, which is back."""
    turned = flown((-1.0, 0.0, 1.0), timestep=1.0)
    assert turned.angular_velocity[0].tolist() == pytest.approx([0, 0, math.pi / 2])
    half = math.sqrt(0.5)
    assert turned.attitude[0].tolist() == pytest.approx([half, 0, 0, half])
    assert turned.position.tolist() == [[1.0, 2.0, 3.0]]
    there = flown((-1.0, 0.0, 1.0), (1.0, 1.0, 0.0), timestep=1.0)
    assert there.position[0].tolist() == pytest.approx([-2.0, 6.0, 3.0])


def test_heading_wraps_around():
    around = flown(*[(-1.0, 0.0, 0.5)] * 8, timestep=1.0)  # 8 times 45 degrees
    assert heading_of(around.attitude).item() == pytest.approx(0, abs=1e-12)
    assert heading_of(flown((0, 0, -1.0)).attitude).item() == pytest.approx(-math.radians(9))


def test_environments_are_independent_and_inputs_unchanged():
    dynamics = Kinematic(SETTINGS)
    body = dynamics.start(torch.zeros(2, 3, dtype=torch.float64))
    after = dynamics.step(body, torch.tensor([[1.0, 0, 0], [-1.0, -1.0, 0]]))
    torch.testing.assert_close(
        after.position, torch.tensor([[0.4, 0, 0], [0, -0.3, 0]], dtype=torch.float64)
    )
    assert body.position.tolist() == [[0, 0, 0]] * 2 and after.position.dtype == torch.float64
