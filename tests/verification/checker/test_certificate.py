"""Read certificates, refuse malformed ones and those of another policy or task."""

import hashlib

import numpy as np
import pytest
import torch

import drone_rl
from drone_rl.config import AppearanceSettings
from drone_rl.policies.zoo import fingerprint
from drone_rl.utils.errors import InputError
from drone_rl.verification.checker import certificate as module
from drone_rl.verification.checker.certificate import (
    Certificate,
    check_same_policy,
    read_certificate,
)
from drone_rl.verification.checker.checker import read_validated
from tests.policies.zoo.test_description import GRAY, STACK, with_image
from tests.verification.checker.making import of_every_place


def test_read_certificate(one_sided, write):
    found = read_certificate(write(one_sided))
    won, lost = found.outcomes
    assert (won.end, won.collected, won.loops) == ("all_cubes", (True,), False)
    assert lost.end == "front_boundary" and set(lost.steps) == {27, 28, 29}
    assert won.share == pytest.approx(0.6375, abs=2e-6)
    assert won.boxes.shape == (1, 1, 2) and won.boxes.dtype == np.float64
    assert (found.policy.name, found.task.lateral_bound) == ("right_and_forward", 6.0)
    assert (found.success, found.lost) == (won.share, lost.share) and not found.is_full_success
    assert [len(boxes) for boxes in found.groups] == [1, 1, 1]
    assert str(won) == "all_cubes, cubes collected: 1"
    assert str(lost) == "front_boundary, cubes collected: none"


def test_fingerprint_by_hand():
    weights = {"b": torch.tensor([[1.0, 2.0]]), "a": torch.tensor([0.5])}
    content = b"a [1]\n" + np.float32([0.5]).tobytes() + b"b [1, 2]\n"
    content += np.float32([1.0, 2.0]).tobytes()
    assert fingerprint(weights) == hashlib.sha256(content).hexdigest()
    assert fingerprint({"a": weights["a"], "b": weights["b"]}) == fingerprint(weights)
    assert fingerprint({**weights, "b": weights["b"].T}) != fingerprint(weights)


@pytest.fixture
def policy():
    return drone_rl.load_policy("right_and_forward")


def test_check_same_policy_and_task(parsed, policy):
    weights = policy.state.weights
    check_same_policy(parsed, policy.description, weights)
    check_same_policy(parsed, policy.description, weights, policy.in_task(num_cubes=1).task)
    with pytest.raises(InputError, match=r"another task: num_cubes=1, not 3; prove"):
        check_same_policy(parsed, policy.description, weights, policy.task)


PARAMETERS = ["policy", "description", "task", "parameters"]


@pytest.mark.parametrize(
    ("keys", "value", "message"),
    [
        (["format"], "drone_rl policy", "format='drone_rl policy'"),
        (["format_version"], 2, "format_version=2"),
        (
            [*PARAMETERS, "vertical_bound"],
            1.0,
            r"vertical_bound=1\.0",
        ),
        (
            [*PARAMETERS, "lateral_bound"],
            0.0,
            r"lateral_bound=0\.0",
        ),
        (
            [*PARAMETERS, "num_cubes"],
            9,
            "num_cubes=9 is out of range",
        ),
        (["outcomes", 0, "end"], "running", "end='running'"),
        (["outcomes", 0, "collected"], [True, True], "must have 1 cubes"),
        (["outcomes", 0, "steps"], {"0": 0.1}, "steps"),
        (["outcomes", 0, "boxes"], [[[1.0, 2.0, 3.0]]], "pair of numbers"),
        (["outcomes", 0, "boxes"], [[[1.0, 2.0], [1.0, 2.0]]], "must have 1 cubes"),
        (["outcomes", 0, "boxes"], [[[1.0, float("inf")]]], "must have borders"),
        (["outcomes", 0, "boxes"], [[[0.0, 2.0**-101]]], "must have borders"),
        (["outcomes", 0, "boxes"], [[[0.0, 2.0**20 + 1]]], "must have borders"),
        (["undecided", "boxes"], [[[1.0, 1.0]]], r"undecided\.boxes must have lower borders"),
        (["finished"], 1, "finished=1"),
    ],
)
def test_malformed_certificates_are_refused(one_sided, write, keys, value, message):
    part = one_sided
    for key in keys[:-1]:
        part = part[key]
    part[keys[-1]] = value
    with pytest.raises(InputError, match=message):
        read_certificate(write(one_sided))


@pytest.mark.parametrize(
    ("limit", "value"), [("MAX_CORNERS", 4), ("MAX_STEPS", 1), ("CERTIFICATE_BYTES", 100)]
)
def test_sizes_are_limited(one_sided, write, monkeypatch, limit, value):
    monkeypatch.setattr(module, limit, value)
    with pytest.raises(InputError, match=r"give at most|too large"):
        read_certificate(write(one_sided))


@pytest.mark.parametrize(
    ("part", "value", "message"),
    [
        ("inputs", with_image(size=[24, 64])["inputs"], "differ in camera"),
        ("inputs", with_image(transforms=[GRAY])["inputs"], "differ in transforms"),
        ("network", {"name": "mlp", "hidden": [3]}, "differ in network"),
        ("inputs", with_image(transforms=[GRAY, STACK])["inputs"], "stacks frames"),
        ("appearance", AppearanceSettings(exposure=(0.01, 1.99)).values(), "without ranges"),
    ],
)
def test_another_description_is_refused(one_sided, policy, part, value, message):
    one_sided["policy"]["description"][part] = value
    with pytest.raises(InputError, match=message):
        check_same_policy(Certificate.read(one_sided), policy.description, policy.state.weights)


def test_read_validated_requires_consistency(write):
    policy = drone_rl.load_policy("good").in_task(num_cubes=2)
    data = of_every_place(policy, undecided=True)
    read = read_validated(write(data), policy.description, policy.state.weights)
    assert (read.success, read.undecided.share) == (0.75, 0.25)
    assert read.task == policy.task
    data["outcomes"][0]["share"] = 0.9
    with pytest.raises(InputError, match=r"is inconsistent: .*share of 0\.9"):
        read_validated(write(data), policy.description, policy.state.weights)
