"""Bounds on chances over boxes: against exact chances within, and by hand."""

import numpy as np
import pytest

import drone_rl
from drone_rl.utils.progress import silent
from drone_rl.verification.prover.lattice import AHEAD, LatticeState
from drone_rl.verification.prover.markov_chain import _WON, _least_mean, _reachable, bound_success
from drone_rl.verification.prover.policy_spec import make_policy_spec


def make_placements(box, points=6):
    """Sample random placements in a box."""
    low, high = np.array(box).T
    return low + np.random.RandomState(0).rand(points, len(box)) * (high - low)


def bounds_over(name, box, most=1):
    """Bounds over a box."""
    policy = drone_rl.load_policy(name).in_task(num_cubes=len(box))
    spec = make_policy_spec(policy.description, policy.make_network(), 1e-4)
    found = bound_success(spec, np.array(box, float), most)
    spec.close()
    return found


def chances_at(name, placements):
    """Exact chances of success at placements. Shape: (P,)."""
    policy = drone_rl.load_policy(name).in_task(num_cubes=placements.shape[1])
    return drone_rl.chances(policy, placements.tolist(), progress=silent).outcomes.success


def test_the_least_mean_by_hand():
    """0.2 to 0.5 of 10, 0.1 to 0.9 of 1 and 0.2 to 0.6 of 4: as much as may be of 1, then of 4."""
    values = np.array([[10.0, 1.0, 4.0]])
    lowest, highest = np.array([[0.2, 0.1, 0.2]]), np.array([[0.5, 0.9, 0.6]])
    assert _least_mean(values, lowest, highest)[0] == pytest.approx(0.2 * 10 + 0.6 * 1 + 0.2 * 4)
    highest[0, 1] = 0.3
    assert _least_mean(values, lowest, highest)[0] == pytest.approx(0.2 * 10 + 0.3 * 1 + 0.5 * 4)


@pytest.mark.parametrize(
    ("name", "box"),
    [
        ("right_and_forward", [[1.6, 1.7]]),
        ("poor", [[-2.0, 2.0]]),
        ("good", [[0.9, 0.92], [-3.0, -2.98]]),
    ],
)
def test_no_placement_has_another_chance(name, box):
    found, exact = bounds_over(name, box), chances_at(name, make_placements(box))
    assert (exact >= found.least).all() and (exact <= found.most).all()
    assert found.mean_least <= found.mean_most


def test_small_boxes_are_exact_and_more_parts_are_closer():
    small = bounds_over("right_and_forward", [[1.3, 1.3 + 1e-6]])
    assert small.most - small.least < 1e-5
    exact = chances_at("right_and_forward", np.array([[1.3]]))
    assert float(exact[0]) == pytest.approx(small.least, abs=1e-5)
    one = bounds_over("right_and_forward", [[1.55, 1.75]])
    many = bounds_over("right_and_forward", [[1.55, 1.75]], most=4)
    # The midpoint rule: the mean of a monotone chance is off by at most 1 / (2 * 12).
    middles = 1.55 + 0.2 * (np.arange(12)[:, None] + 0.5) / 12
    exact = chances_at("right_and_forward", middles)
    assert many.mean_most - many.mean_least < 0.8 * (one.mean_most - one.mean_least)
    assert many.mean_least - 0.05 < float(exact.mean()) < many.mean_most + 0.05
    assert many.least >= one.least and many.most <= one.most


def test_a_box_of_no_width_has_the_bounds_of_its_placement():
    found = bounds_over("right_and_forward", [[1.6, 1.6]], most=2)
    assert 0 <= found.mean_least == found.least <= found.most == found.mean_most <= 1


@pytest.mark.parametrize("lowest", [-1.7, -1.65])
def test_a_box_includes_its_ends(lowest):
    """A cube at -1.65 m is touched straight ahead, and no other one of the box from -1.7 m."""
    policy = drone_rl.load_policy("right_and_forward").in_task(num_cubes=1)
    spec = make_policy_spec(policy.description, policy.make_network(), 1e-4)
    states, targets = _reachable(spec, np.array([[lowest, -1.65]]))
    spec.close()
    assert _WON in targets[states.index(LatticeState(13, 0)), AHEAD]


def test_a_box_at_the_edge_of_touch_has_the_bounds_of_its_placement():
    found = bounds_over("right_and_forward", [[-1.65, -1.65]])
    exact = chances_at("right_and_forward", np.array([[-1.65]]))
    assert found.least <= float(exact[0]) <= found.most
