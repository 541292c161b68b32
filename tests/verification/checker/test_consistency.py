"""Exact consistency of certificates: partition, volumes, possible outcomes and step counts."""

from fractions import Fraction

import numpy as np
import pytest

from drone_rl.verification.checker.certificate import Certificate, Outcome
from drone_rl.verification.checker.consistency import (
    find_inconsistencies,
    find_partition_error,
    find_wrong_step_counts,
    volume,
)


def inconsistencies(data):
    return list(find_inconsistencies(Certificate.read(data)))


def test_steps_may_add_up_to_their_share_up_to_rounding(one_sided):
    won = one_sided["outcomes"][0]
    for excess, accepted in ((1e-13, True), (1e-9, False)):
        won["steps"] = {"20": won["share"] * (1 + excess)}
        assert (inconsistencies(one_sided) == []) == accepted


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"share": 0.6}, "has a share of 0.6, but boxes of 0.637"),
        ({"end": "side_boundary"}, "if and only if all are collected"),
        ({"collected": [False]}, "if and only if all are collected"),
        ({"loops": True}, "an oscillation ends at the step limit"),
        ({"steps": {"301": 0.1}}, "has more steps than step_limit=300"),
        ({"steps": {"14": 0.5, "15": 0.5}}, "has a share of 0.637"),
        (
            {"end": "step_limit", "collected": [False], "steps": {"299": 0.1}},
            "another number of steps than step_limit=300",
        ),
        ({"boxes": [[[-6.0, 1.6]]]}, "do not partition the placements next to"),
        ({"boxes": [[[-6.5, 1.649]]]}, "do not partition the placements next to"),
        ({"boxes": [[[-6.0, 6.0]]]}, "the boxes have 1.36"),
        ({"undecided": 0.1}, "undecided has a share of"),
    ],
)
def test_each_inconsistency_is_found(one_sided, change, line):
    one_sided["undecided"]["share"] += change.pop("undecided", 0.0)
    one_sided["outcomes"][0] |= change
    found = inconsistencies(one_sided)
    assert any(line in one for one in found), found


def test_duplicate_outcomes(two_halves):
    won = two_halves["outcomes"][0]
    halves = [
        {**won, "steps": {"20": s}, "share": s, "boxes": [b]}
        for s, b in zip((7 / 12, 5 / 12), won["boxes"], strict=True)
    ]
    two_halves["outcomes"] = halves
    (found,) = inconsistencies(two_halves)
    assert "outcomes 0 and 1 are the same" in found


def test_finished_without_undecided_boxes(two_halves):
    two_halves["finished"] = False
    assert inconsistencies(two_halves) == ["finished is false, but nothing is undecided"]


SQUARE = [
    [[-1.0, 0.0], [-1.0, 1.0]],
    [[0.0, 1.0], [-1.0, 0.25]],
    [[0.0, 1.0], [0.25, 1.0]],
]
"""Three rectangles that make up [-1, 1]^2."""


def random_partition(cubes, count, bound=6.0, seed=0):
    """Boxes, each cut in two at random until there are enough."""
    rng = np.random.default_rng(seed)
    boxes = np.full((1, cubes, 2), (-bound, bound))
    while len(boxes) < count:
        k = min(len(boxes), count - len(boxes))
        row, axis = np.arange(k), rng.integers(cubes, size=k)
        low, high = boxes[:k].copy(), boxes[:k].copy()
        size = low[row, axis, 1] - low[row, axis, 0]
        cut = low[row, axis, 0] + (0.1 + 0.8 * rng.random(k)) * size
        low[row, axis, 1] = high[row, axis, 0] = cut
        boxes = np.concatenate([boxes[k:], low, high])
    return boxes


def test_a_partition_by_hand():
    assert find_partition_error(np.array(SQUARE), 1.0) is None
    assert volume(np.array(SQUARE)) == 4


def test_volumes_are_exact():
    boxes = np.array([[[0.0, 0.1], [0.0, 0.1]], [[0.1, 0.3], [0.0, 1.0]]])
    tenth, wider = Fraction(0.1), Fraction(0.3)
    assert volume(boxes) == tenth**2 + (wider - tenth)
    assert volume(np.zeros((0, 2, 2))) == 0
    assert volume(np.array([[[5e-324, 1.0]]])) == 1 - Fraction(1, 2**1074)


@pytest.mark.parametrize(
    "boxes",
    [
        SQUARE[:2],
        [*SQUARE, SQUARE[0]],
        [[[-1.0, 0.5], [-1.0, 1.0]], *SQUARE[1:]],
        [[[-1.0, -0.5], [-1.0, 1.0]], *SQUARE[1:]],
        [SQUARE[0], SQUARE[1], [[0.0, 1.0], [np.nextafter(0.25, 1), 1.0]]],
        [SQUARE[0], SQUARE[1], [[0.0, 1.0], [np.nextafter(0.25, 0), 1.0]]],
        np.zeros((0, 2, 2)),
    ],
)
def test_partition_errors(boxes):
    corner = np.array(find_partition_error(np.array(boxes), 1.0))
    every = np.concatenate([np.array(boxes), [[[-1.0, 1.0], [-1.0, 1.0]]]])
    assert ((every == corner[:, None]).any(2).all(1)).any()


@pytest.mark.parametrize(("cubes", "count"), [(1, 50), (2, 300), (3, 20_000), (5, 3000)])
def test_random_partitions_and_those_off_by_one_bit(cubes, count):
    boxes = random_partition(cubes, count)
    assert find_partition_error(boxes, 6.0) is None
    assert volume(boxes) == 12**cubes
    for change in (-1, 1):
        other = boxes.copy()
        other[7, 0, 0] = np.nextafter(other[7, 0, 0], change * np.inf)
        assert find_partition_error(other, 6.0) is not None
        assert volume(other) != 12**cubes


OWNER = np.repeat([0, 1], [800, 200])


STEPS = np.repeat([10, 11, 0], [600, 200, 200])
"""Of 1000 flights 600 took 10 steps, 200 took 11; of 200 nothing is stated."""


def won(steps, share):
    about = {"end": "all_cubes", "collected": [True], "loops": False}
    return Outcome.read(about | {"share": share, "steps": steps, "boxes": []})


def wrong(steps, share=0.8):
    return list(find_wrong_step_counts([won(steps, share)], OWNER, STEPS))


@pytest.mark.parametrize("steps", [{10: 0.6, 11: 0.2}, {10: 0.62, 11: 0.18}, {10: 0.5}, {}])
def test_step_counts_within_chance(steps):
    assert wrong(steps) == []


@pytest.mark.parametrize(
    ("steps", "number"),
    [({10: 0.2, 11: 0.6}, 10), ({10: 0.8}, 10), ({12: 0.3}, 12), ({10: 0.6, 12: 0.2}, 12)],
)
def test_step_counts_beyond_chance(steps, number):
    lines = wrong(steps)
    assert any(f"to take {number} steps" in line for line in lines), lines
    assert all("of 1000 random flights refute" in line for line in lines)


def test_missing_step_counts_may_be_any():
    """Of a share of 0.8 the steps of 0.1 are open: 600 of 1000 may be said to be 0.52, not 0.3."""
    assert wrong({10: 0.52, 11: 0.18}) == []
    assert any("to take 10 steps" in line for line in wrong({10: 0.3, 11: 0.4}))


def test_unstated_step_counts_are_counted_together():
    """Each of them is too seldom to refute anything: 40 flights of 1000, all different."""
    outcome = won({10: 1.0 - 1e-6}, 1.0)
    steps = np.concatenate([np.full(960, 10), np.arange(20, 60)])
    *_, line = find_wrong_step_counts([outcome], np.zeros(1000, int), steps)
    assert "other numbers of steps than those stated" in line and "40 of 1000" in line
    usual = np.concatenate([np.full(999, 10), [20]])
    assert not list(find_wrong_step_counts([outcome], np.zeros(1000, int), usual))
