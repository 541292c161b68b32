"""States that do not fit a training run are refused before any part is loaded."""

import pytest
import torch
from torch import nn

from drone_rl.training.restore import check_fits, check_optimizer
from drone_rl.utils.errors import InputError

OWN = {"a": torch.zeros(2), "b": [1, 0.5], "c": None, "d": "x", "f": {}}


@pytest.mark.parametrize("change", [{}, {"a": torch.ones(2)}, {"b": (2, 3)}, {"c": object()}])
def test_matching_states_are_accepted(change):
    check_fits({**OWN, **change}, OWN, "state")


@pytest.mark.parametrize(
    "change",
    [
        *({"a": torch.zeros(3)}, {"a": torch.zeros(2).double()}, {"a": [0.0, 0.0]}),
        *({"b": [1]}, {"b": [True, 0.5]}, {"b": [1, "x"]}, {"d": 3}, {"f": {"g": 1}}, {"h": 1}),
    ],
)
def test_mismatched_states_raise(change):
    (name,) = change
    with pytest.raises(InputError, match=rf"state(\.{name}|.* other names)"):
        check_fits({**OWN, **change}, OWN, "state")


def make_optimizer(kind, *, is_stepped, outputs=1):
    network = nn.Linear(2, outputs)
    optimizer = kind(network.parameters(), lr=0.1)
    if is_stepped:
        network(torch.ones(1, 2)).sum().backward()
        optimizer.step()
    return optimizer


@pytest.mark.parametrize("kind", [torch.optim.Adam, torch.optim.SGD, torch.optim.RMSprop])
def test_optimizer_states_before_and_after_the_first_step_are_accepted(kind):
    fresh, stepped = (make_optimizer(kind, is_stepped=is_stepped) for is_stepped in (False, True))
    for own in (fresh, stepped):
        for saved in (fresh, stepped):
            check_optimizer(saved.state_dict(), own)
    assert not fresh.state_dict()["state"]


def test_states_of_other_optimizers_raise():
    own = make_optimizer(torch.optim.Adam, is_stepped=True)
    wider = make_optimizer(torch.optim.Adam, is_stepped=True, outputs=2)
    other = make_optimizer(torch.optim.SGD, is_stepped=True)
    for saved in (wider.state_dict(), other.state_dict(), {}, 5):
        with pytest.raises(InputError, match="optimizer"):
            check_optimizer(saved, own)
