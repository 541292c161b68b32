"""Whole proofs of one cube: what is known of it by hand, and against flights."""

import numpy as np
import pytest

import drone_rl
from drone_rl.sim.tasks.collect_cubes import EndReason
from drone_rl.verification.prover.boxes import volumes
from drone_rl.verification.prover.lattice import LatticeState
from drone_rl.verification.prover.policy_spec import make_policy_spec
from drone_rl.verification.prover.prover import Prover


class Noting(Prover):
    """Notes the volume of the forked boxes when a part is finished."""

    def __init__(self, *args):
        super().__init__(*args)
        self.forked_volumes = []

    def _finish_part(self):
        self.forked_volumes.append(sum(volumes(b).sum() for b in self.forked))
        super()._finish_part()


def prove(name, gap=1e-4, most=500_000_000, **task):
    policy = drone_rl.load_policy(name).in_task(num_cubes=1, **task)
    spec = make_policy_spec(policy.description, policy.make_network(), gap)
    prover = Noting(spec, most)
    while not prover.is_finished:
        prover.advance()
    spec.close()
    return prover


@pytest.fixture(scope="module")
def one_sided():
    return prove("right_and_forward")


@pytest.fixture(scope="module")
def narrow():
    """The same with less room for the cube: 2 m to each side."""
    return prove("right_and_forward", lateral_bound=2.0)


def shares(findings, bound=6.0):
    parts = {
        (ending.reason.name, ending.collected): float(volumes(boxes).sum()) / (2 * bound)
        for ending, boxes in findings.endings.items()
    }
    return parts, float(volumes(findings.undecided).sum()) / (2 * bound)


def test_the_share_that_a_policy_collects(one_sided):
    """It never goes to the left: it collects what stands up to 1.65 m to its left."""
    parts, undecided = shares(one_sided.findings())
    assert parts[("ALL_CUBES", 1)] == pytest.approx((6 + 1.65) / 12, abs=1e-9)
    assert parts[("FRONT_BOUNDARY", 0)] == pytest.approx((6 - 1.65) / 12, abs=1e-9)
    assert undecided < 1e-6


def test_part_by_part_it_comes_to_the_same(narrow):
    partition_placements = prove("right_and_forward", most=200, lateral_bound=2.0)
    assert partition_placements.num_states > narrow.num_states
    (parts, undecided), (whole, left) = (
        shares(partition_placements.findings(), bound=2.0),
        shares(narrow.findings(), bound=2.0),
    )
    assert parts == pytest.approx(whole, abs=1e-12) and undecided == pytest.approx(left, abs=1e-12)
    assert partition_placements.findings().steps.keys() == narrow.findings().steps.keys()


def test_no_part_of_a_box_is_lost_to_rounding():
    """Less than a unit roundoff from a cell, an end of the box counts as in the next cell."""
    policy = drone_rl.load_policy("right_and_forward").in_task(num_cubes=1)
    spec = make_policy_spec(policy.description, policy.make_network(), 1e-4)
    prover, tried = Prover(spec), 0
    for left in range(-12, 13):
        state = LatticeState(10, left)
        limits = prover._all_cells(state, [0], np.array([[[-20.0, 20.0]]]))[0].limits[1:-1]
        below = np.nextafter(limits + left, -np.inf)
        lost = (below - left >= limits) & (abs(below) < 5.9)
        for low in below[lost][:2]:
            parts = [part for _, part in prover._cut(state, np.array([[[low, 6.0]]]))]
            assert np.concatenate(parts)[:, 0, 0].min() == low
            tried += 1
    spec.close()
    assert tried


def test_steps_are_counted(one_sided):
    """At y=0 it takes 14 steps ahead and none to the side."""
    steps = one_sided.findings().steps
    (won,) = [e for e in steps if e.reason is EndReason.ALL_CUBES]
    assert min(steps[won]) == 14
    assert sum(steps[won].values()) <= (6 + 1.65) + 1e-9


def test_it_says_what_flights_show(one_sided):
    findings = one_sided.findings()
    won = np.concatenate([b for e, b in findings.endings.items() if e.collected])
    share = float(volumes(won).sum()) / 12
    policy = drone_rl.load_policy("right_and_forward").in_task(num_cubes=1)
    flown = drone_rl.evaluate(policy, episodes=200, baselines=False).success
    assert abs(flown - share) < 5 * (share * (1 - share) / 200) ** 0.5


def test_half_way_the_rest_is_undecided():
    policy = drone_rl.load_policy("right_and_forward").in_task(num_cubes=1)
    spec = make_policy_spec(policy.description, policy.make_network(), 1e-4)
    prover = Prover(spec)
    for _ in range(5):
        prover.advance()
    parts, undecided = shares(prover.findings())
    spec.close()
    assert not prover.is_finished and prover.boxes_under_way > 0
    assert parts == {} and undecided == 1.0


def test_a_part_that_is_done_is_settled_and_how_it_came_is_forgotten():
    policy = drone_rl.load_policy("right_and_forward").in_task(num_cubes=1, lateral_bound=2.0)
    spec = make_policy_spec(policy.description, policy.make_network(), 1e-4)
    prover, most = Prover(spec, 200), 0
    while not prover.is_finished:
        prover.advance()
        most = max(most, len(prover.forked), len(prover.ended))
        findings = prover.findings()
        parts, undecided = shares(findings, bound=2.0)
        assert sum(parts.values()) + undecided == pytest.approx(1.0, abs=1e-12)
        assert sum(parts.values()) * 4.0 == pytest.approx(findings.decided, abs=1e-12)
        assert sum(parts.values()) * 4.0 <= prover.decided + 1e-9
        counted = sum(sum(steps.values()) for steps in findings.steps.values())
        assert counted <= findings.decided + 1e-12
    spec.close()
    assert most and not prover.ended and not prover.forked and not prover.fork_ends
    assert not len(prover.part) and prover.decided == pytest.approx(findings.decided)


def test_parts_that_are_not_begun_with_are_undecided():
    policy = drone_rl.load_policy("right_and_forward").in_task(num_cubes=1, lateral_bound=2.0)
    spec = make_policy_spec(policy.description, policy.make_network(), 1e-4)
    prover = Prover(spec, 200)
    count = len(prover.parts)
    assert count > 2 and shares(prover.findings(), bound=2.0) == ({}, pytest.approx(1.0))
    prover.advance()
    while prover.waiting:
        waiting = [len(part) for parts in prover.waiting.values() for part in parts]
        assert prover.boxes_under_way == sum(waiting)
        prover.advance()
    assert prover.boxes_under_way == 0
    spec.close()
    parts, undecided = shares(prover.findings(), bound=2.0)
    assert len(prover.parts) == count - 1 and not prover.is_finished
    assert parts == {("ALL_CUBES", 1): pytest.approx(1 / count, abs=1e-6)}
    assert undecided == pytest.approx(1 - 1 / count, abs=1e-6)


def test_where_logits_are_close_nothing_is_claimed(narrow):
    """The larger the gap that is asked for, the more ways are followed, and nothing is wrong."""
    careful = prove("right_and_forward", gap=3.0, lateral_bound=2.0)
    assert narrow.forked_volumes[0] < 1e-3 < careful.forked_volumes[0]
    parts, _ = shares(careful.findings(), bound=2.0)
    assert parts.get(("ALL_CUBES", 1), 0) <= (2 + 1.65) / 4 + 1e-9
    assert parts.get(("FRONT_BOUNDARY", 0), 0) <= (2 - 1.65) / 4 + 1e-9


def test_to_and_fro_ends_at_the_step_limit(monkeypatch):
    """Whoever turns left where it came from the right, and back, goes on until the step limit."""
    policy = drone_rl.load_policy("good").in_task(num_cubes=1)
    spec = make_policy_spec(policy.description, policy.make_network(), 1e-4)
    prover = Prover(spec)
    monkeypatch.setattr(
        prover, "_cut", lambda place, boxes: [(2 if place.left % 2 == 0 else 4, boxes)]
    )
    while not prover.is_finished:
        prover.advance()
    spec.close()
    (ending,) = prover.findings().endings
    assert ending.loops and ending.reason is EndReason.STEP_LIMIT and ending.collected == 0


def test_a_fork_is_decided_only_if_all_its_ways_end_alike(monkeypatch):
    """Straight on is won near the middle; to the left for ever is lost everywhere."""
    policy = drone_rl.load_policy("good").in_task(num_cubes=1)
    spec = make_policy_spec(policy.description, policy.make_network(), 1e-4)
    prover = Prover(spec)

    def both_at_first(place, boxes):
        is_start = place.ahead == place.left == 0
        return [(3 if is_start else 2 if place.left else 1, boxes)]

    monkeypatch.setattr(prover, "_cut", both_at_first)
    while not prover.is_finished:
        prover.advance()
    spec.close()
    parts, undecided = shares(prover.findings())
    assert parts == {} and undecided == 1.0


def test_bigger_steps_and_other_cubes_can_be_proved():
    prover = prove("good", step_length=1.25, cube_size=2.0, lateral_bound=2.0)
    parts, undecided = shares(prover.findings(), bound=2.0)
    assert sum(parts.values()) + undecided == pytest.approx(1.0, abs=1e-9)
