import hashlib

import numpy as np
import pytest
import torch

import drone_rl
from drone_rl.config import AppearanceSettings
from drone_rl.policies.zoo import fingerprint
from drone_rl.utils.errors import InputError
from drone_rl.verification.checker.certificate import check_same_policy, parse_certificate


def test_the_hash_by_hand():
    weights = {"b": torch.tensor([[1.0, 2.0]]), "a": torch.tensor([0.5])}
    content = b"a [1]\n" + np.float32([0.5]).tobytes() + b"b [1, 2]\n"
    content += np.float32([1.0, 2.0]).tobytes()
    assert fingerprint(weights) == hashlib.sha256(content).hexdigest()
    assert fingerprint({"a": weights["a"], "b": weights["b"]}) == fingerprint(weights)
    assert fingerprint({**weights, "b": weights["b"].T}) != fingerprint(weights)


@pytest.fixture
def policy():
    return drone_rl.load_policy("right_and_forward")


def test_its_own_policy_is_accepted_in_any_task_or_the_one_asked_for(parsed, policy):
    weights = policy.state["policy"]
    check_same_policy(parsed, policy.description, weights)
    check_same_policy(parsed, policy.description, weights, policy.in_task(num_cubes=1).task)
    with pytest.raises(InputError, match=r"another task: num_cubes=1, not 3; prove"):
        check_same_policy(parsed, policy.description, weights, policy.task)


def test_another_network_is_refused(parsed):
    other = drone_rl.load_policy("good")
    with pytest.raises(InputError, match=r"hash 38f68e02c181\..*network has 5eefc41fd425"):
        check_same_policy(parsed, other.description, other.state["policy"])


def changed(one_sided, part, value):
    one_sided["policy"]["description"][part] = value
    return parse_certificate(one_sided)


@pytest.mark.parametrize(
    ("part", "value"),
    [
        ("camera", {"width": 64, "height": 25, "horizontal_fov": 134.0}),
        ("transforms", [{"name": "gray"}]),
        ("network", {"name": "mlp", "hidden": [3]}),
    ],
)
def test_other_eyes_are_refused(one_sided, policy, part, value):
    with pytest.raises(InputError, match=f"differ in {part}"):
        check_same_policy(
            changed(one_sided, part, value), policy.description, policy.state["policy"]
        )


def test_a_policy_with_a_memory_has_no_certificate(one_sided):
    with pytest.raises(InputError, match=r"certificates support only .* stacks frames"):
        changed(one_sided, "transforms", [{"name": "gray"}, {"name": "stack", "N": 2}])


def test_a_policy_in_sampled_appearances_has_no_certificate(one_sided):
    """The checker would simulate one of them, and the others could end otherwise."""
    sampled = AppearanceSettings(exposure=(0.01, 1.99)).values()
    with pytest.raises(InputError, match="certificates support only appearances without ranges"):
        changed(one_sided, "appearance", sampled)


def test_a_policy_in_another_body_has_no_certificate(parsed, policy):
    moved = policy.in_dynamics(mode="simple_flight")
    with pytest.raises(
        InputError,
        match=r"only dynamics=computer_vision, got .*simple_flight",
    ):
        check_same_policy(parsed, moved.description, policy.state["policy"])
