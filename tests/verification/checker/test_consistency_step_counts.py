import numpy as np
import pytest

from drone_rl.sim.tasks.collect_cubes import EndReason
from drone_rl.verification.checker.certificate import Outcome
from drone_rl.verification.checker.consistency import find_wrong_step_counts

OWNER = np.repeat([0, 1], [800, 200])
STEPS = np.repeat([10, 11, 0], [600, 200, 200])
"""Of 1000 flights 600 took 10 steps, 200 took 11; of 200 nothing is stated."""


def wrong(steps, share=0.8):
    nowhere = np.zeros((0, 1, 2))
    outcome = Outcome(EndReason.ALL_CUBES, (True,), False, share, steps, nowhere)
    return list(find_wrong_step_counts([outcome], OWNER, STEPS))


@pytest.mark.parametrize("steps", [{10: 0.6, 11: 0.2}, {10: 0.62, 11: 0.18}, {10: 0.5}, {}])
def test_what_luck_can_explain_or_is_not_stated_is_accepted(steps):
    assert wrong(steps) == []


@pytest.mark.parametrize(
    ("steps", "number"),
    [({10: 0.2, 11: 0.6}, 10), ({10: 0.8}, 10), ({12: 0.3}, 12), ({10: 0.6, 12: 0.2}, 12)],
)
def test_what_luck_can_not_explain_is_told(steps, number):
    lines = wrong(steps)
    assert any(f"to take {number} steps" in line for line in lines), lines
    assert all("of 1000 random flights refute" in line for line in lines)


def test_what_is_stated_of_all_and_of_none_is_accepted():
    """An interval's end that equals what is stated refutes nothing: 1 of all, 0 of none."""
    nowhere = np.zeros((0, 1, 2))
    steps, owner = np.full(1000, 10), np.zeros(1000, int)
    for stated in ({10: 1.0}, {10: 1.0, 12: 0.0}):
        outcome = Outcome(EndReason.ALL_CUBES, (True,), False, 1.0, stated, nowhere)
        assert list(find_wrong_step_counts([outcome], owner, steps)) == []


def test_what_is_open_may_be_of_any_number_and_no_more():
    """Of a share of 0.8 the steps of 0.1 are open: 600 of 1000 may be said to be 0.52, not 0.3."""
    assert wrong({10: 0.52, 11: 0.18}) == []
    assert any("to take 10 steps" in line for line in wrong({10: 0.3, 11: 0.4}))


def test_numbers_that_are_not_stated_are_counted_together():
    """Each of them is too seldom to refute anything: 40 flights of 1000, all different."""
    nowhere = np.zeros((0, 1, 2))
    outcome = Outcome(EndReason.ALL_CUBES, (True,), False, 1.0, {10: 1.0 - 1e-6}, nowhere)
    steps = np.concatenate([np.full(960, 10), np.arange(20, 60)])
    *_, line = find_wrong_step_counts([outcome], np.zeros(1000, int), steps)
    assert "other numbers of steps than those stated" in line and "40 of 1000" in line
    usual = np.concatenate([np.full(999, 10), [20]])
    assert not list(find_wrong_step_counts([outcome], np.zeros(1000, int), usual))
