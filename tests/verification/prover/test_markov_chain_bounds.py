"""Bounds on chances over boxes: against exact chances within, and by hand."""

import numpy as np
import pytest

import drone_rl
from drone_rl.utils.progress import silent
from drone_rl.verification.prover.markov_chain import _extreme, bound_success
from drone_rl.verification.prover.policy_spec import make_policy_spec


def bounds_and_chances(name, box, most=1, points=12):
    """Bounds over a box, and the exact chances of random placements in it."""
    policy = drone_rl.load_policy(name).in_task(num_cubes=len(box))
    spec = make_policy_spec(policy.description, policy.make_network(), 1e-4)
    found = bound_success(spec, np.array(box, float), most)
    spec.close()
    low, high = np.array(box).T
    inside = low + np.random.RandomState(0).rand(points, len(box)) * (high - low)
    return found, drone_rl.chances(policy, inside.tolist(), progress=silent).outcomes.success


def test_the_least_mean_by_hand():
    """0.2 to 0.5 of 10, 0.1 to 0.9 of 1 and 0.2 to 0.6 of 4: as much as may be of 1, then of 4."""
    values = np.array([[10.0, 1.0, 4.0]])
    lowest, highest = np.array([[0.2, 0.1, 0.2]]), np.array([[0.5, 0.9, 0.6]])
    assert _extreme(values, lowest, highest)[0] == pytest.approx(0.2 * 10 + 0.6 * 1 + 0.2 * 4)
    highest[0, 1] = 0.3
    assert _extreme(values, lowest, highest)[0] == pytest.approx(0.2 * 10 + 0.3 * 1 + 0.5 * 4)


@pytest.mark.parametrize(
    ("name", "box"),
    [
        ("right_and_forward", [[1.6, 1.7]]),
        ("poor", [[-2.0, 2.0]]),
        ("good", [[0.9, 0.92], [-3.0, -2.98]]),
    ],
)
def test_no_placement_has_another_chance(name, box):
    found, exact = bounds_and_chances(name, box)
    assert (exact >= found.least).all() and (exact <= found.most).all()
    assert found.mean_least <= found.mean_most


def test_small_boxes_are_exact_and_more_parts_are_closer():
    small, exact = bounds_and_chances("right_and_forward", [[1.3, 1.3 + 1e-6]])
    assert small.most - small.least < 1e-5
    assert float(exact[0]) == pytest.approx(small.least, abs=1e-5)
    one, exact = bounds_and_chances("right_and_forward", [[1.5, 1.9]], points=200)
    many, _ = bounds_and_chances("right_and_forward", [[1.5, 1.9]], most=12)
    assert many.mean_most - many.mean_least < 0.8 * (one.mean_most - one.mean_least)
    assert many.mean_least - 0.05 < float(exact.mean()) < many.mean_most + 0.05
    assert many.least >= one.least and many.most <= one.most
