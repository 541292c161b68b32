import itertools
import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drone_rl.sim.tasks import CollectCubes
from drone_rl.trust.rule import (
    BLIND_BASELINES,
    SIDES,
    Quantity,
    Rule,
    VerdictKind,
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
        (levels(), VerdictKind.GOOD),
        (levels(shares=(2, 1, 2)), VerdictKind.NONE),  # dodges cubes ahead
        (levels(shares=(2, 1, 2), offered=(1, 0, 1)), VerdictKind.GOOD),  # there are next to none
        (levels(success=0), VerdictKind.NONE),
        (levels(success=0, above=(1, 0, 1, 1)), VerdictKind.POOR),  # no better than one luck
        (levels(success=0, shares=(0, 0, 2)), VerdictKind.ONE_SIDED_RIGHT),
        (levels(success=0, shares=(2, 2, 0)), VerdictKind.ONE_SIDED_LEFT),
        (levels(success=0, shares=(0, 2, 2), above=(0, 0, 0, 0)), VerdictKind.ONE_SIDED_RIGHT),
        (levels(shares=(0, 2, 2)), VerdictKind.ONE_SIDED_RIGHT),  # succeeds, but not on its left
        (levels(shares=(0, 2, 2), offered=(0, 1, 1)), VerdictKind.GOOD),
        (levels(success=0, shares=(0, 2, 2), offered=(0, 1, 1)), VerdictKind.NONE),
        (levels(success=0, shares=(1, 2, 2)), VerdictKind.NONE),
        (levels(success=0, shares=(0, 2, 1)), VerdictKind.NONE),
        (levels(unsolved=(1, 0, 1, 1)), VerdictKind.TRIVIAL),
        (levels(unsolved=(0, 0, 0, 0), above=(0, 0, 0, 0)), VerdictKind.TRIVIAL),
        (levels(success=0, unsolved=(0, 1, 1, 1)), VerdictKind.NONE),  # not even good
        (levels(success=0, unsolved=(1, 0, 1, 1), above=(1, 0, 1, 1)), VerdictKind.POOR),
        (levels(above=(1, 0, 1, 1)), VerdictKind.GOOD),  # succeeds more often than the baseline
    ],
)
def test_kinds_by_hand(found, kind):
    assert decide(found) is kind


def quantity(value, lower=0.0, upper=1.0):
    return Quantity(value=value, lower=lower, upper=upper, thresholds=(0.3, 0.7))


def test_level_at_a_threshold():
    assert [level(x, (0.3, 0.7)) for x in (0.29, 0.3, 0.31, 0.7, 0.71)] == [0, 0, 1, 1, 2]
    assert quantity(0.7 + 1e-12).level == 1  # rounding
    assert quantity(None).level == 0


def test_levels_of_an_interval():
    assert quantity(0.5, 0.4, 0.6).levels == (1, 1)
    assert quantity(0.5, 0.3, 0.7).levels == (0, 2)  # ends are within it
    assert quantity(0.9).levels == (0, 2)


def test_kinds_within_a_box():
    """Left about 0.68 of 0.7, right about 0.32 of 0.3: one-sided lies within both intervals."""
    box = [(0, 0), (1, 1), (1, 1), (1, 1), (1, 2), (2, 2), (0, 1), *[(1, 1)] * 8]
    assert kinds_within(tuple(box)) == {VerdictKind.NONE, VerdictKind.ONE_SIDED_LEFT}


def mirrored(kind):
    """The kind with left and right exchanged."""
    left, right = VerdictKind.ONE_SIDED_LEFT, VerdictKind.ONE_SIDED_RIGHT
    return {left: right, right: left}.get(kind, kind)


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
    assert decide(swapped) is mirrored(decide(found))


@given(st.tuples(*LEVELS), st.integers(0, len(RULE.quantities) - 1))
def test_more_success_never_lowers_the_kind(found, which):
    """Sides that are offered more often are a harder task, and are left alone."""
    if RULE.quantities[which].startswith("offered"):
        return
    better = list(found)
    better[which] = len(RULE.thresholds[which])
    if decide(found) is VerdictKind.GOOD:
        assert decide(better) is VerdictKind.GOOD
    if decide(found) is VerdictKind.NONE:
        assert decide(better) is not VerdictKind.POOR


@pytest.mark.parametrize(
    "value",
    [
        0.0,
        float("nan"),
    ],
)
def test_thresholds_out_of_range(value):
    with pytest.raises(InputError, match=f"good_share={value!r}"):
        Rule(good_share=value)


def test_thresholds_that_contradict_each_other():
    with pytest.raises(InputError, match=r"other_share=0\.8"):
        Rule(other_share=0.8)


def test_defaults_are_those_of_cube_collection():
    assert CollectCubes.strata == SIDES and CollectCubes.blind_baselines == BLIND_BASELINES
    assert (RULE.strata, RULE.blind_baselines) == (SIDES, BLIND_BASELINES)


@pytest.mark.parametrize(
    ("levels", "kind"),
    [
        ((1, 1, 1, 2, 2, 1, 1), VerdictKind.GOOD),
        ((1, 1, 1, 2, 2, 1, 0), VerdictKind.TRIVIAL),
        ((0, 1, 1, 0, 2, 1, 1), VerdictKind.ONE_SIDED_RIGHT),
        ((0, 1, 1, 2, 0, 1, 1), VerdictKind.ONE_SIDED_LEFT),
        ((0, 1, 0, 2, 0, 1, 1), VerdictKind.NONE),
        ((0, 1, 1, 1, 1, 0, 1), VerdictKind.POOR),
    ],
)
def test_rule_for_two_strata_and_one_baseline(levels, kind):
    """Success, two offered, two reached, above one baseline, unsolved by it."""
    assert decide(levels, 2) is kind
    assert kinds_within(tuple((level, level) for level in levels), 2) == {kind}
    rule = Rule(strata=("left", "right"), blind_baselines=("random",))
    assert rule.quantities == (
        "success", "offered left", "offered right", "collected left", "collected right",
        "above random", "unsolved by random",
    )  # fmt: skip
    assert len(rule.thresholds) == 7 and rule.confidence == 1 - 0.05 / 7


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


def test_exit_statuses():
    assert [kind.exit_code for kind in VerdictKind] == [0, 18, 10, 11, 11, 12]


def test_kinds_need_no_torch():
    code = "import sys, drone_rl.trust.rule; sys.exit('torch' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
