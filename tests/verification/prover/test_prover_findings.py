"""What is known of placements, with intervals that a person can follow."""

import numpy as np
import pytest

from drone_rl.verification.prover import prover as module
from drone_rl.verification.prover.boxes import volumes
from drone_rl.verification.prover.prover import (
    ProofFindings,
    combine,
    ended,
    simplified,
    so_far,
)


def line(*intervals):
    return np.array(intervals, float).reshape(-1, 1, 2)


def test_what_is_followed_to_its_end():
    known = {("won", 7): [line([0, 1]), line([1, 3])], ("won", 9): [line([4, 5])]}
    found = ended(known | {("lost", 7): [line([3, 4])]}, line())
    assert {e: len(b) for e, b in found.endings.items()} == {"won": 3, "lost": 1}
    assert found.steps == {"won": {7: 3.0, 9: 1.0}, "lost": {7: 1.0}}
    assert found.decided == 5.0 and not len(found.undecided)


def test_parts_put_together():
    some = [
        ProofFindings({"won": line([0, 1])}, line([1, 2]), {"won": {3: 1.0}}),
        ProofFindings({"won": line([2, 4]), "lost": line()}, line(), {"won": {3: 2.0, 4: 0.5}}),
        ProofFindings({}, line([4, 9]), {}),
    ]
    found = combine(some)
    assert {e: b.tolist() for e, b in found.endings.items()} == {"won": [[[0, 1]], [[2, 4]]]}
    assert found.undecided.tolist() == [[[1, 2]], [[4, 9]]]
    assert found.steps == {"won": {3: 3.0, 4: 0.5}}


def test_the_largest_part_is_what_the_others_leave():
    won = line(*[[i, i + 1] for i in range(0, 9, 2)], [1, 2], [3, 4], [5, 6])
    found = ProofFindings({"won": won, "lost": line([7, 8])}, line(), {"won": {1: 8.0}})
    simple = simplified(found, line([0, 9]))
    assert sorted(simple.endings["won"].tolist()) == [[[0, 7]], [[8, 9]]]
    assert simple.endings["lost"].tolist() == [[[7, 8]]]
    assert not len(simple.undecided) and simple.steps == {"won": {1: 8.0}}
    nothing = simplified(ProofFindings({}, line([0, 4], [4, 9]), {}), line([0, 9]))
    assert nothing.undecided.tolist() == [[[0, 9]]] and not nothing.endings


@pytest.mark.parametrize(("most", "stated"), [(100, [3, 1]), (3, [2, 1]), (2, [1, 1]), (1, [1, 0])])
def test_the_largest_boxes_of_a_part_under_way(most, stated, monkeypatch):
    """Of each ending in turn, the largest first; all else of the part is undecided."""
    monkeypatch.setattr(module, "MAX_STATED", most)
    known = {("won", 7): [line([0, 1], [3, 6])], ("won", 9): [line([7, 9])]}
    found = so_far(known | {("lost", 2): [line([6, 7])]}, line([0, 12]))
    assert [len(found.endings.get(e, ())) for e in ("won", "lost")] == stated
    assert [3, 6] in found.endings["won"][:, 0].tolist()
    assert found.decided + volumes(found.undecided).sum() == 12.0
    assert sum(sum(steps.values()) for steps in found.steps.values()) == found.decided
    sure = np.concatenate([*found.endings.values(), found.undecided])[:, 0]
    assert (np.sort(sure, 0)[1:, 0] == np.sort(sure, 0)[:-1, 1]).all()


def test_of_a_part_whose_rest_would_take_too_long_less_is_stated(monkeypatch):
    complement = module.complement
    monkeypatch.setattr(
        module,
        "complement",
        lambda boxes, space: None if len(boxes) > 1 else complement(boxes, space),
    )
    found = so_far({("won", 7): [line([0, 1], [3, 6], [7, 9])]}, line([0, 12]))
    assert found.endings["won"].tolist() == [[[3, 6]]]
    assert found.undecided.tolist() == [[[0, 3]], [[6, 12]]]


def test_nothing_is_known_before_anything_has_ended():
    assert so_far({}, line([0, 12])).undecided.tolist() == [[[0, 12]]]
