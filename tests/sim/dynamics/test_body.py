import torch

from drone_rl.sim.dynamics import BodyState


def test_a_body_at_rest_is_level_unless_it_is_turned():
    place = torch.tensor([[1.0, 2.0, 3.0]], dtype=torch.float64)
    body = BodyState.at_rest(place)
    assert body.position.tolist() == [[1, 2, 3]] and body.attitude.tolist() == [[1, 0, 0, 0]]
    assert not body.velocity.any() and not body.angular_velocity.any()
    assert all(value.dtype == torch.float64 for value in vars(body).values())
    turned = torch.tensor([[0.0, 0.0, 0.0, 1.0]], dtype=torch.float64)
    assert BodyState.at_rest(place, turned).attitude is turned


def test_no_two_fields_share_memory():
    body = BodyState.at_rest(torch.zeros(2, 3, dtype=torch.float64))
    body.velocity += 1.0
    body.attitude[0] = 0.5
    assert not body.angular_velocity.any() and body.attitude[1].tolist() == [1, 0, 0, 0]
