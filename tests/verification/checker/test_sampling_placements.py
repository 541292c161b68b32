import dataclasses

import numpy as np

from drone_rl.verification.checker.sampling import ANYWHERE, BORDER, INSIDE, sample_placements


def test_places_know_what_is_stated_of_them(parsed):
    drawn = sample_placements(parsed, 400, np.random.default_rng(0))
    assert drawn.points.shape == (400, 1)
    border = 1.65
    assert (drawn.outcome[drawn.points[:, 0] < border - 2e-5] == 0).all()
    assert (drawn.outcome[drawn.points[:, 0] > border + 2e-5] == 1).all()
    count = {why: int((drawn.why == why).sum()) for why in (INSIDE, BORDER, ANYWHERE)}
    assert count[INSIDE] == 32  # a box of one cube needs no more than 4 times 4
    assert 2 <= count[BORDER] <= 12
    near = drawn.points[drawn.why == BORDER, 0]
    assert np.abs(near - border).max() < 2e-4


def test_a_seed_draws_the_same(parsed):
    one, other, third = (sample_placements(parsed, 50, np.random.default_rng(s)) for s in (1, 1, 2))
    assert (one.points == other.points).all() and not (one.points == third.points).all()


def test_with_nothing_decided_there_is_nothing_to_fly(parsed):
    whole = np.array([[[-6.0, 6.0]]])
    nothing = dataclasses.replace(parsed, outcomes=(), undecided=whole)
    drawn = sample_placements(nothing, 10, np.random.default_rng(0))
    assert drawn.outcome.tolist() == [0] * 10
    assert set(drawn.why) == {ANYWHERE}
