import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drone_rl.sim.tasks import CollectCubes
from drone_rl.trust import rule
from drone_rl.trust.rule import (
    BLIND_BASELINES,
    SIDES,
    Kind,
    Quantity,
    Rule,
    decide,
    kinds_within,
    level,
)
from drone_rl.utils.errors import InputError

RULE = Rule()
LEVELS = [st.integers(0, len(t)) for t in RULE.thresholds]
BOXES = st.tuples(*(st.tuples(level, level).map(lambda p: (min(p), max(p))) for level in LEVELS))


def levels(
    success=1, offered=(1, 1, 1), shares=(2, 2, 2), above=(1, 1, 1, 1), unsolved=(1, 1, 1, 1)
):
    return (success, *offered, *shares, *above, *unsolved)


@pytest.mark.parametrize(
    ("found", "kind"),
    [
        (levels(), Kind.GOOD),
        (levels(shares=(2, 1, 2)), Kind.NONE),  # dodges cubes ahead
        (levels(shares=(2, 1, 2), offered=(1, 0, 1)), Kind.GOOD),  # there are next to none
        (levels(success=0), Kind.NONE),
        (levels(success=0, above=(1, 0, 1, 1)), Kind.POOR),  # no better than one luck
        (levels(success=0, shares=(0, 0, 2)), Kind.ONE_SIDED_RIGHT),
        (levels(success=0, shares=(2, 2, 0)), Kind.ONE_SIDED_LEFT),
        (levels(success=0, shares=(0, 2, 2), above=(0, 0, 0, 0)), Kind.ONE_SIDED_RIGHT),
        (levels(shares=(0, 2, 2)), Kind.ONE_SIDED_RIGHT),  # succeeds, but not on its left
        (levels(shares=(0, 2, 2), offered=(0, 1, 1)), Kind.GOOD),
        (levels(success=0, shares=(0, 2, 2), offered=(0, 1, 1)), Kind.NONE),
        (levels(success=0, shares=(1, 2, 2)), Kind.NONE),
        (levels(success=0, shares=(0, 2, 1)), Kind.NONE),
        (levels(unsolved=(1, 0, 1, 1)), Kind.TRIVIAL),
        (levels(unsolved=(0, 0, 0, 0), above=(0, 0, 0, 0)), Kind.TRIVIAL),
        (levels(success=0, unsolved=(0, 1, 1, 1)), Kind.NONE),  # not even good
        (levels(success=0, unsolved=(1, 0, 1, 1), above=(1, 0, 1, 1)), Kind.POOR),
        (levels(above=(1, 0, 1, 1)), Kind.GOOD),  # succeeds more often than the baseline
    ],
)
def test_kinds_by_hand(found, kind):
    assert decide(found) is kind


def test_who_equals_a_threshold_does_not_exceed_it():
    assert [level(x, (0.3, 0.7)) for x in (0.29, 0.3, 0.31, 0.7, 0.71)] == [0, 0, 1, 1, 2]
    assert Quantity(0.7 + 1e-12, 0.0, 1.0, (0.3, 0.7)).level == 1  # rounding
    assert Quantity(None, 0.0, 1.0, (0.3, 0.7)).level == 0


def test_an_interval_reaches_every_level_that_it_touches():
    assert Quantity(0.5, 0.4, 0.6, (0.3, 0.7)).levels == (1, 1)
    assert Quantity(0.5, 0.3, 0.7, (0.3, 0.7)).levels == (0, 2)  # ends are within it
    assert Quantity(0.9, 0.0, 1.0, (0.3, 0.7)).levels == (0, 2)


def test_thresholds_of_every_quantity():
    thresholds = dict(zip(RULE.quantities, RULE.thresholds, strict=True))
    assert thresholds["success"] == (0.0,)
    assert thresholds["offered ahead"] == (0.05,)
    assert thresholds["collected left"] == (0.3, 0.7)
    assert [thresholds[f"above {name}"] for name in BLIND_BASELINES] == [(0.0,)] * 4
    assert [thresholds[f"unsolved by {name}"] for name in BLIND_BASELINES] == [(0.0,)] * 4
    assert RULE.confidence == pytest.approx(1 - 0.05 / 15)


def test_no_corner_of_a_box_is_missed():
    """Left about 0.68 of 0.7, right about 0.32 of 0.3: one-sided lies within both intervals."""
    box = [(0, 0), (1, 1), (1, 1), (1, 1), (1, 2), (2, 2), (0, 1), *[(1, 1)] * 8]
    assert kinds_within(tuple(box)) == {Kind.NONE, Kind.ONE_SIDED_LEFT}


@given(BOXES, st.data())
def test_every_cell_is_seen(box, data):
    cell = [data.draw(st.integers(low, high)) for low, high in box]
    assert decide(cell) in kinds_within(box)


@given(st.tuples(*LEVELS))
def test_a_mirrored_policy_gets_the_mirrored_kind(found):
    swapped = list(found)
    for a, b in (
        ("offered", "offered"),
        ("collected", "collected"),
        ("above", "above"),
        ("unsolved by", "unsolved by"),
    ):
        left, right = RULE.quantities.index(f"{a} left"), RULE.quantities.index(f"{b} right")
        swapped[left], swapped[right] = swapped[right], swapped[left]
    assert decide(swapped) is decide(found).mirrored


@given(st.tuples(*LEVELS), st.integers(0, len(RULE.quantities) - 1))
def test_more_success_keeps_a_good_policy_good_and_makes_none_poor(found, which):
    """Sides that are offered more often are a harder task, and are left alone."""
    if RULE.quantities[which].startswith("offered"):
        return
    better = list(found)
    better[which] = len(RULE.thresholds[which])
    if decide(found) is Kind.GOOD:
        assert decide(better) is Kind.GOOD
    if decide(found) is Kind.NONE:
        assert decide(better) is not Kind.POOR


def test_every_kind_can_be_given():
    ranges = [range(len(t) + 1) for t in RULE.thresholds]
    assert {decide(cell) for cell in itertools.product(*ranges)} == set(Kind)


@pytest.mark.parametrize("value", [0.0, 1.0, -1, float("nan"), "much", True])
def test_shares_out_of_range(value):
    with pytest.raises(InputError, match=f"good_share={value!r}"):
        Rule(good_share=value)


def test_thresholds_that_contradict_each_other():
    with pytest.raises(InputError, match=r"other_share=0\.8"):
        Rule(other_share=0.8)


def test_the_rule_in_words_has_its_numbers():
    text = Rule(good_share=0.8).text
    assert all(
        part in text for part in ("more than 80% of the oracle's", "70%", "30%", "5%", "17%")
    )


def test_the_text_says_every_number():
    shares = {"good_share": 0.81, "side_share": 0.62, "other_share": 0.23, "offered_share": 0.14}
    text = Rule(**shares, poor_margin=0.35, error_rate=0.06).text
    for share in ("81% of the oracle's", "than 62% of", "23% on", "14% of episodes", "35% of the"):
        assert share in text
    assert "94% probability" in text
    assert "more than 92.5% of the oracle's" in Rule(good_share=0.925).text


@pytest.mark.parametrize(
    "value", [-0.5, 0, 0.0, 1, 1.0, 1.5, float("nan"), float("inf"), True, "x"]
)
def test_no_share_is_refused_by_its_name(value):
    with pytest.raises(InputError, match="good_share="):
        Rule(good_share=value)


def test_the_strata_and_luck_of_the_rule_are_those_of_cube_collection():
    assert CollectCubes.strata == SIDES and CollectCubes.blind_baselines == BLIND_BASELINES
    assert (RULE.strata, RULE.blind_baselines) == (SIDES, BLIND_BASELINES)


@pytest.mark.parametrize(
    ("levels", "kind"),
    [
        ((1, 1, 1, 2, 2, 1, 1), Kind.GOOD),
        ((1, 1, 1, 2, 2, 1, 0), Kind.TRIVIAL),
        ((0, 1, 1, 0, 2, 1, 1), Kind.ONE_SIDED_RIGHT),
        ((0, 1, 1, 2, 0, 1, 1), Kind.ONE_SIDED_LEFT),
        ((0, 1, 0, 2, 0, 1, 1), Kind.NONE),
        ((0, 1, 1, 1, 1, 0, 1), Kind.POOR),
    ],
)
def test_a_task_may_have_two_strata_and_one_luck(levels, kind):
    """Success, two offered, two reached, above one baseline, unsolved by it."""
    assert decide(levels, 2) is kind
    assert kinds_within(tuple((level, level) for level in levels), 2) == {kind}
    rule = Rule(strata=("left", "right"), blind_baselines=("random",))
    assert rule.quantities == (
        "success", "offered left", "offered right", "collected left", "collected right",
        "above random", "unsolved by random",
    )  # fmt: skip
    assert len(rule.thresholds) == 7 and rule.confidence == 1 - 0.05 / 7


def test_many_strata_are_not_multiplied(monkeypatch):
    calls = []

    def count(*of):
        calls.append(of)
        return decide(*of)

    monkeypatch.setattr(rule, "decide", count)
    box = ((0, 1), *[(0, 1)] * 7, *[(0, 2)] * 7, (0, 1), (0, 1))
    assert kinds_within(box, 7) == set(Kind)
    assert len(calls) < 2000


def test_inner_strata_are_reduced_exactly():
    """All boxes of four strata with some levels, against every single cell."""
    ends = ((0, 1), (1, 1))
    for offered in itertools.product(ends, repeat=2):
        for shares in itertools.product(((0, 0), (0, 2), (2, 2)), repeat=4):
            box = ((1, 1), (1, 1), *offered, (1, 1), *shares, (1, 1), (1, 1))
            cells = itertools.product(*(range(low, high + 1) for low, high in box))
            assert kinds_within(box, 4) == {decide(cell, 4) for cell in cells}


@pytest.mark.parametrize("name", ["strata", "blind_baselines"])
def test_a_task_has_strata_and_baselines(name):
    with pytest.raises(InputError, match=f"a task without {name} can't be judged"):
        Rule(**{name: ()})
    with pytest.raises(InputError, match="can't be called"):
        Rule(strata=("all", "left"))
