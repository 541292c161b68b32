import math

import pytest
import torch

from drone_rl.sim.dynamics import BodyState
from drone_rl.sim.dynamics.state import twist_about_z


def test_body_at_rest_is_level_by_default():
    place = torch.tensor([[1.0, 2.0, 3.0]], dtype=torch.float64)
    body = BodyState.at_rest(place)
    assert body.position.tolist() == [[1, 2, 3]] and body.attitude.tolist() == [[1, 0, 0, 0]]
    assert not body.velocity.any() and not body.angular_velocity.any()
    assert all(value.dtype == torch.float64 for value in vars(body).values())
    turned = torch.tensor([[0.0, 0.0, 0.0, 1.0]], dtype=torch.float64)
    assert BodyState.at_rest(place, turned).attitude is turned


def test_fields_share_no_memory():
    body = BodyState.at_rest(torch.zeros(2, 3, dtype=torch.float64))
    body.velocity += 1.0
    body.attitude[0] = 0.5
    assert not body.angular_velocity.any() and body.attitude[1].tolist() == [1, 0, 0, 0]


@pytest.mark.parametrize("yaw", [0.0, 0.7, -3.0, 3.0])
def test_heading_only_removes_roll_and_pitch(yaw):
    """Attitudes apply roll and pitch first, then yaw."""

    def about(axis, angle):
        return [math.cos(angle / 2), *(math.sin(angle / 2) * float(i == axis) for i in range(3))]

    def times(p, q):
        a, b = p[0] * q[0] - sum(x * y for x, y in zip(p[1:], q[1:], strict=True)), []
        for i, j, k in ((1, 2, 3), (2, 3, 1), (3, 1, 2)):
            b.append(p[0] * q[i] + p[i] * q[0] + p[j] * q[k] - p[k] * q[j])
        return [a, *b]

    expected = torch.tensor([about(2, yaw)], dtype=torch.float64)
    for roll, pitch in ((0.0, 0.0), (0.4, 0.0), (0.0, -0.3), (-1.2, 0.0)):
        q = times(about(2, yaw), times(about(1, pitch), about(0, roll)))
        for sign in (1.0, -1.0):  # both quaternions of one attitude
            attitude = sign * torch.tensor([q], dtype=torch.float64)
            found = twist_about_z(attitude)
            torch.testing.assert_close(found, sign * expected, atol=1e-12, rtol=0)


def test_heading_only_keeps_level_attitudes_exactly():
    level = torch.tensor([[[1.0, 0.0, 0.0, 0.0]]]).double()
    assert torch.equal(twist_about_z(level), level)


def test_inverted_attitude_has_no_heading():
    turned = torch.tensor([[0.0, 1.0, 0.0, 0.0], [0.0, 0.6, 0.8, 0.0]]).double()
    assert twist_about_z(turned).tolist() == [[1.0, 0.0, 0.0, 0.0]] * 2
