import pytest
import torch

from drone_rl.policies import MLP
from drone_rl.policies.networks import require_finite
from drone_rl.utils.errors import InputError


def test_non_finite_logits_raise_with_the_value():
    require_finite(torch.zeros(2, 3))
    with pytest.raises(InputError, match=r"policy=a gives .* \(nan\) for an observation"):
        require_finite(torch.tensor([[0.0, torch.nan], [1.0, 2.0]]), "policy=a")
    with pytest.raises(InputError, match=r"\(inf\) for 2 observations"):
        require_finite(torch.full((2, 3), torch.inf))


def test_actor_raises_for_non_finite_logits():
    network = MLP((1, 2, 2), 2, hidden=(2,))
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.fill_(1e38)
        with pytest.raises(InputError, match="non-finite action logits"):
            network(torch.ones(1, 1, 2, 2))
    assert not network(torch.ones(1, 1, 2, 2)).isfinite().all()  # learners raise their own error
