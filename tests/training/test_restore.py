"""Invalid states are rejected by name before any part is loaded."""

import contextlib
import copy

import pytest
import torch
from torch import nn

from drone_rl.training.restore import check_fits, check_optimizer
from drone_rl.utils.errors import InputError

OWN = {"a": torch.zeros(2), "b": [1, 0.5], "c": None, "d": "x", "e": True, "f": {}}


@pytest.mark.parametrize(
    "change",
    [{}, {"a": torch.ones(2)}, {"b": (2, 3)}, {"b": [1, 2.5]}, {"c": object()}],
)
def test_matching_states_are_accepted(change):
    check_fits({**OWN, **change}, OWN, "state")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"a": torch.zeros(3)}, r"state\.a is not of shape \(2,\)"),
        ({"a": torch.zeros(2).double()}, "torch.float32"),
        ({"a": [0.0, 0.0]}, r"state\.a"),
        ({"a": torch.tensor([0.0, float("nan")])}, "holds NaN"),
        ({"b": [1]}, "not a list of 2"),
        ({"b": [True, 0.5]}, r"b\[0\] is True"),
        ({"b": [1.0, 0.5]}, r"b\[0\] is 1\.0"),
        ({"b": [1, "x"]}, r"b\[1\] is 'x'"),
        ({"b": [1, float("inf")]}, r"b\[1\] is inf"),
        ({"d": "y"}, "d is 'y'"),
        ({"e": 1}, "e is 1"),
        ({"f": {"g": 1}}, "other names"),
        ({"h": 1}, "state has other names"),
    ],
)
def test_mismatched_states_raise(change, message):
    with pytest.raises(InputError, match=message):
        check_fits({**OWN, **change}, OWN, "state")


@pytest.mark.parametrize(
    ("saved", "fits"),
    [
        ([1.0, float("nan")], True),
        ([float("nan")] * 2, True),
        ([1.0, 2.0], True),
        ([1.0, float("inf")], False),
    ],
)
def test_nan_is_accepted_where_the_own_state_has_it(saved, fits):
    own = {"lateral": torch.tensor([0.5, float("nan")])}
    with contextlib.nullcontext() if fits else pytest.raises(InputError, match="infinity"):
        check_fits({"lateral": torch.tensor(saved)}, own, "state")


def stepped(kind=torch.optim.Adam, **settings):
    torch.manual_seed(0)
    network = nn.Linear(2, 1)
    optimizer = kind(network.parameters(), lr=0.1, **settings)
    network(torch.ones(1, 2)).sum().backward()
    optimizer.step()
    return network, optimizer


@pytest.mark.parametrize("kind", [torch.optim.Adam, torch.optim.SGD, torch.optim.RMSprop])
def test_own_optimizer_state_is_accepted(kind):
    network, optimizer = stepped(kind)
    before = {k: v.clone() for k, v in network.state_dict().items()}
    check_optimizer(optimizer.state_dict(), optimizer)
    fresh = kind(nn.Linear(2, 1).parameters(), lr=0.1)
    check_optimizer(fresh.state_dict(), fresh)
    check_optimizer(optimizer.state_dict(), fresh)
    assert all(torch.equal(before[k], v) for k, v in network.state_dict().items())
    assert not fresh.state_dict()["state"]


def test_only_the_learning_rate_may_differ():
    _, optimizer = stepped()
    state = copy.deepcopy(optimizer.state_dict())
    state["param_groups"][0]["lr"] = 0.05
    check_optimizer(state, optimizer)
    state["param_groups"][0]["betas"] = (0.5, 0.5)
    with pytest.raises(InputError, match=r"optimizer\.betas"):
        check_optimizer(state, optimizer)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda s: s["state"][0].update(exp_avg=torch.zeros(5)), "exp_avg"),
        (lambda s: s["state"][0].update(more=1), "other names"),
        (lambda s: s["state"].pop(0), "other names"),
        (lambda s: s["param_groups"][0].update(capturable=True), "capturable"),
        (lambda s: s["param_groups"][0].update(lr="0.1"), "lr"),
        (lambda s: s["param_groups"][0].update(params=[1, 0]), "params"),
        (lambda s: s["param_groups"].append({}), "list of 1"),
        (lambda s: s.clear(), "other names"),
    ],
)
def test_foreign_optimizer_states_raise(change, message):
    _, optimizer = stepped()
    state = copy.deepcopy(optimizer.state_dict())
    change(state)
    with pytest.raises(InputError, match=message):
        check_optimizer(state, optimizer)
    with pytest.raises(InputError):
        check_optimizer(5, optimizer)


def test_infinity_is_accepted_where_the_own_state_has_it():
    own = {"closest": torch.tensor([0.5, float("inf")])}
    check_fits({"closest": torch.tensor([float("inf"), 1.0])}, own, "state")
    with pytest.raises(InputError, match="holds NaN or infinity"):
        check_fits({"closest": torch.tensor([float("nan"), 1.0])}, own, "state")


@pytest.mark.gpu
@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a CUDA GPU")
def test_a_state_on_the_cpu_fits_one_on_a_gpu():
    check_fits({"a": torch.zeros(2)}, {"a": torch.zeros(2, device="cuda")}, "state")
