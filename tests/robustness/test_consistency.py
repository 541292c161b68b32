"""Figures that contradict each other, one contradiction each; `test_measured` reads whole files."""

import copy

import pytest

import drone_rl
from benchmarks.evidence import changed
from drone_rl.robustness.consistency import _is_same, check_counts, check_probe, check_range
from drone_rl.sim.tasks import as_task
from drone_rl.utils.errors import InputError
from tests.robustness.making import owned, share, shifts_of


@pytest.fixture(scope="module")
def good():
    return drone_rl.load_policy("good")


@pytest.fixture
def numbers(good):
    return shifts_of(good)


def test_counts_that_go_together_pass_unchanged(good, numbers):
    before = copy.deepcopy(numbers)
    check_counts(numbers, as_task(good.description.task))
    assert numbers == before


@pytest.mark.parametrize(
    ("lie", "message"),
    [
        ({"plain.oracle": share(200, 201)}, "plain.oracle is of 201 episodes, not of 200"),
        ({"together.oracle": share(150)}, "together.impossible does not follow from its oracle"),
        (
            {"axes.blur.levels.0.modes.constant.paired.gained": 1},
            r"axes.blur.levels.0.paired: gained - lost is not .*; run drone-rl shifts again",
        ),
    ],
)
def test_counts_that_contradict_each_other_are_refused(good, numbers, lie, message):
    with pytest.raises(InputError, match=message):
        check_counts(changed(numbers, lie), as_task(good.description.task))


@pytest.mark.parametrize("name", ["blur", "dead_rows"])
def test_a_range_has_to_follow_from_its_answers(good, numbers, name):
    of = good.description
    axis, found = owned(name, of), numbers["domain"]["ranges"][name]
    check_range(axis, found, of, numbers)
    low, high = found["positions"]
    with pytest.raises(InputError, match=f"domain.ranges.{name} contradicts its tested strengths"):
        check_range(axis, {**found, "positions": [low, high + 0.01]}, of, numbers)


def test_no_strength_is_good_at_which_the_counts_say_otherwise(good, numbers):
    """Of the first strength of blur 20 of 200 succeeded, by the table; the range calls it good."""
    of, bad = good.description, share(20)
    lie = changed(numbers, {"axes.blur.levels.0.modes.constant.success": bad})
    with pytest.raises(InputError, match=r"says good at .*, and axes.blur counts 10% there"):
        check_range(owned("blur", of), lie["domain"]["ranges"]["blur"], of, lie)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"success": 0.5012}, "here.success is not a fraction of 400 episodes"),
        ({"fragile": 401}, "here.fragile is more than its 400 episodes"),
        ({"good": True}, "here is good, but also bad or refused"),
        ({"oracle": share(9, 10)}, "here.oracle is of 10 episodes, not of 400"),
    ],
)
def test_a_strength_has_to_agree_with_itself(change, message):
    found = {"good": False, "bad": True, "refused": None, "success": 0.5, "worst": None}
    found |= {"fragile": 400, "oracle": share(1, 400)}
    check_probe(found, 400, "here")
    with pytest.raises(InputError, match=message):
        check_probe({**found, **change}, 400, "here")


@pytest.mark.parametrize("name", ["success", "fragile", "worst"])
def test_a_strength_that_is_allowed_has_figures(name):
    refused = {"good": False, "bad": True, "refused": "task.cube_size=9"}
    check_probe(refused, 400, "here")
    found = {**refused, "refused": None, "success": 0.5, "fragile": 0, "worst": None}
    check_probe(found, 400, "here")
    del found[name]
    with pytest.raises(InputError, match=f"here is not refused, and has no {name}; run drone-rl"):
        check_probe(found, 400, "here")


def test_numbers_are_compared_up_to_rounding():
    assert _is_same(0.1 + 0.2, 0.3) and _is_same(None, None)
    assert not _is_same(0.3, 0.301)
    assert not _is_same(None, 0.3) and not _is_same(0.3, None)
