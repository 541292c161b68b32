"""Whole proofs of one cube by hand and compared with episodes; findings of parts."""

import numpy as np
import pytest

import drone_rl
from drone_rl.sim.tasks.collect_cubes import CubesEnd
from drone_rl.verification.prover import prover as module
from drone_rl.verification.prover.boxes import volumes
from drone_rl.verification.prover.lattice import LatticeState
from drone_rl.verification.prover.policy_spec import make_policy_spec
from drone_rl.verification.prover.prover import (
    ProofFindings,
    Prover,
    simplified,
    so_far,
)

NARROW = {"lateral_bound": 2.0}


@pytest.fixture(scope="module")
def make_prover():
    """Return a function that begins a proof of one cube."""
    specs = []

    def make(most=500_000_000, gap=1e-4, **task):
        policy = drone_rl.load_policy("right_and_forward").in_task(num_cubes=1, **task)
        specs.append(make_policy_spec(policy.description, policy.make_network(), gap))
        return Prover(specs[-1], most)

    yield make
    for spec in specs:
        spec.close()


def finish(prover):
    while not prover.is_finished:
        prover.advance()
    return prover


@pytest.fixture(scope="module")
def one_sided(make_prover):
    return finish(make_prover())


@pytest.fixture(scope="module")
def narrow(make_prover):
    """The same with less room for the cube: 2 m to each side."""
    return finish(make_prover(**NARROW))


def shares(findings, bound=6.0):
    parts = {
        (ending.reason.name, ending.collected): float(volumes(boxes).sum()) / (2 * bound)
        for ending, boxes in findings.endings.items()
    }
    return parts, float(volumes(findings.undecided).sum()) / (2 * bound)


def test_fraction_of_success(one_sided):
    """It never goes to the left: it collects what stands up to 1.65 m to its left."""
    parts, undecided = shares(one_sided.findings())
    assert parts[("ALL_CUBES", 1)] == pytest.approx((6 + 1.65) / 12, abs=1e-9)
    assert parts[("FRONT_BOUNDARY", 0)] == pytest.approx((6 - 1.65) / 12, abs=1e-9)
    assert undecided < 1e-6


def test_parts_give_the_same_result(narrow, make_prover):
    several = finish(make_prover(200, **NARROW))
    assert several.num_states > narrow.num_states
    (parts, undecided), (whole, left) = (shares(p.findings(), 2.0) for p in (several, narrow))
    assert parts == pytest.approx(whole, abs=1e-12) and undecided == pytest.approx(left, abs=1e-12)
    assert several.findings().steps.keys() == narrow.findings().steps.keys()


def test_cuts_lose_no_part_of_a_box(make_prover):
    """Less than a unit roundoff from a cell, an end of the box counts as in the next cell."""
    prover, tried = make_prover(), 0
    for left in range(-12, 13):
        state = LatticeState(10, left)
        limits = prover._cells_of(state, 0, -20.0, 20.0).limits[1:-1]
        below = np.nextafter(limits + left, -np.inf)
        lost = (below - left >= limits) & (abs(below) < 5.9)
        for low in below[lost][:2]:
            parts = [part for _, part in prover._cut(state, np.array([[[low, 6.0]]]))]
            assert np.concatenate(parts)[:, 0, 0].min() == low
            tried += 1
    assert tried


def test_step_counts(one_sided):
    """At y=0 it takes 14 steps ahead and none to the side."""
    steps = one_sided.findings().steps
    (won,) = [e for e in steps if e.reason is CubesEnd.ALL_CUBES]
    assert min(steps[won]) == 14
    assert sum(steps[won].values()) <= (6 + 1.65) + 1e-9


def test_findings_at_every_step(make_prover):
    """Decided and undecided placements fill the space; of parts done, only findings are kept."""
    prover = make_prover(200, **NARROW)
    assert len(prover.parts) > 2
    while not prover.is_finished:
        prover.advance()
        findings = prover.findings()
        parts, undecided = shares(findings, bound=2.0)
        assert sum(parts.values()) + undecided == pytest.approx(1.0, abs=1e-12)
        assert findings.decided <= prover.decided + 1e-9
        counted = sum(sum(steps.values()) for steps in findings.steps.values())
        assert counted <= findings.decided + 1e-12
        waiting = [len(part) for boxes in prover.waiting.values() for part in boxes]
        assert prover.boxes_under_way == sum(waiting)
    assert not prover.ended and not prover.forked and not prover.fork_ends
    assert prover.decided == pytest.approx(findings.decided)


def test_close_logits_decide_nothing(narrow, make_prover):
    """With a larger gap, more placements follow several actions, and no statement is wrong."""
    prover, careful = make_prover(gap=3.0, **NARROW), 0.0
    while not prover.is_finished:
        prover.advance()
        careful = max(careful, sum(volumes(boxes).sum() for boxes in prover.forked))
    assert careful > 1e-3
    parts, _ = shares(prover.findings(), bound=2.0)
    assert parts.get(("ALL_CUBES", 1), 0) <= (2 + 1.65) / 4 + 1e-9
    assert parts.get(("FRONT_BOUNDARY", 0), 0) <= (2 - 1.65) / 4 + 1e-9


def test_oscillations_end_at_the_step_limit(make_prover, monkeypatch):
    prover = make_prover()
    monkeypatch.setattr(
        prover, "_cut", lambda place, boxes: [(2 if place.left % 2 == 0 else 4, boxes)]
    )
    (ending,) = finish(prover).findings().endings
    assert ending.loops and ending.reason is CubesEnd.STEP_LIMIT and ending.collected == 0


def test_forks_are_decided_only_if_all_branches_end_alike(make_prover, monkeypatch):
    """Straight on succeeds near the middle; to the left for ever fails everywhere."""
    prover = make_prover()

    def both_at_first(place, boxes):
        is_start = place.ahead == place.left == 0
        return [(3 if is_start else 2 if place.left else 1, boxes)]

    monkeypatch.setattr(prover, "_cut", both_at_first)
    parts, undecided = shares(finish(prover).findings())
    assert parts == {} and undecided == 1.0


def line(*intervals):
    return np.array(intervals, float).reshape(-1, 1, 2)


def test_simplified():
    won = line(*[[i, i + 1] for i in range(0, 9, 2)], [1, 2], [3, 4], [5, 6])
    found = ProofFindings({"won": won, "lost": line([7, 8])}, line(), {"won": {1: 8.0}})
    simple = simplified(found, line([0, 9]))
    assert sorted(simple.endings["won"].tolist()) == [[[0, 7]], [[8, 9]]]
    assert simple.endings["lost"].tolist() == [[[7, 8]]]
    assert not len(simple.undecided) and simple.steps == {"won": {1: 8.0}}
    nothing = simplified(ProofFindings({}, line([0, 4], [4, 9]), {}), line([0, 9]))
    assert nothing.undecided.tolist() == [[[0, 9]]] and not nothing.endings


@pytest.mark.parametrize(("most", "stated"), [(100, [3, 1]), (2, [2, 0]), (1, [1, 0])])
def test_so_far(most, stated, monkeypatch):
    """The largest boxes are stated; all else of the part is undecided."""
    monkeypatch.setattr(module, "MAX_STATED", most)
    known = {("won", 7): [line([0, 1], [3, 6])], ("won", 9): [line([7, 9])]}
    found = so_far(known | {("lost", 2): [line([6, 7])]}, line([0, 12]))
    assert [len(found.endings.get(e, ())) for e in ("won", "lost")] == stated
    assert [3, 6] in found.endings["won"][:, 0].tolist()
    assert found.decided + volumes(found.undecided).sum() == 12.0
    assert sum(sum(steps.values()) for steps in found.steps.values()) == found.decided
    sure = np.concatenate([*found.endings.values(), found.undecided])[:, 0]
    assert (np.sort(sure, 0)[1:, 0] == np.sort(sure, 0)[:-1, 1]).all()
