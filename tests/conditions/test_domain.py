"""How far axes may go, by policies of which that is known, and by liars."""

import dataclasses

import pytest
import torch

from drone_rl.conditions import domain
from drone_rl.conditions.axes import AXES
from drone_rl.conditions.axis import Axis
from drone_rl.conditions.condition import Condition
from drone_rl.conditions.domain import Prober, is_surely_good
from drone_rl.conditions.flying import Airfield
from drone_rl.conditions.oracle import OracleEyes
from drone_rl.sim.settings import TaskSettings
from drone_rl.verdicts.rule import Quantity, Rule
from tests.conditions.subjects import Blind, subject


@pytest.fixture
def make_prober():
    beds = []

    def make(of, episodes=300):
        bed = Airfield(of, episodes)
        beds.append(bed)
        return Prober(bed, bed.fly(Condition(), eyes=OracleEyes(looks=False)).episodes, 0.9)

    yield make
    for bed in beds:
        bed.close()


def found_at(prober, limits, monkeypatch):
    """Lets a policy be good exactly within limits, whatever it is; counts what is asked."""
    asked = []

    def probe(condition):
        strength = condition.task["strength"]
        asked.append(strength)
        good = limits[0] <= strength <= limits[1]
        return {"good": good, "bad": not good, "refused": None, "success": 0.5, "worst": None}

    monkeypatch.setattr(prober, "probe", probe)
    return asked


def axis(strengths, neutral=0.0, whole=False):
    return Axis(
        *("a", "b", "m", neutral, strengths),
        lambda s, _: Condition(task={"strength": s}),
        value=lambda s, _: 10 * s,
        whole=whole,
    )


def test_limits_are_found_by_halving_and_are_never_too_wide(make_prober, monkeypatch):
    prober = make_prober(subject(), 1)
    prober.plain = {"good": True}
    asked = found_at(prober, (-1.3, 2.6), monkeypatch)
    found = prober.search(axis((1.0, -1.0, 2.0, -2.0, 4.0)))
    # between 2 and 4: 3 no, 2.5 yes, 2.75 no, 2.625 no
    # between -1 and -2: -1.5 no, -1.25 yes, -1.375 no, -1.3125 no
    assert (found["low"], found["high"]) == (-12.5, 25.0)
    assert found["positions"] == [-1.25, 2.5]
    assert [failed["value"] for failed in found["failed"]] == [-20.0, 40.0]
    assert (found["low_open"], found["high_open"]) == (False, False)
    assert found["tests"] == len(asked) == 5 + 8 <= domain.TESTS
    assert all(-1.3 <= s <= 2.6 for s in found["positions"])


def test_what_is_good_to_the_end_is_open_there(make_prober, monkeypatch):
    prober = make_prober(subject(), 1)
    prober.plain = {"good": True}
    found_at(prober, (0.0, 9.0), monkeypatch)
    found = prober.search(axis((1.0, 2.0, 3.0, 4.0, 5.0)))
    assert (found["low"], found["high"], found["tests"]) == (0.0, 50.0, 5)
    assert (found["low_open"], found["high_open"]) == (None, True)


def test_a_hole_ends_the_range(make_prober, monkeypatch):
    """Good at 3 again, but not at 2: nearer strengths are not taken for granted."""
    prober = make_prober(subject(), 1)
    prober.plain = {"good": True}

    def probe(condition):
        return {"good": condition.task["strength"] in (1.0, 3.0, 4.0), "bad": True}

    monkeypatch.setattr(prober, "probe", probe)
    found = prober.search(axis((1.0, 2.0, 3.0, 4.0, 5.0), whole=True))
    assert (found["high"], found["tests"]) == (10.0, 2)


def test_who_sees_nothing_is_good_nowhere(make_prober):
    """A wide cube right ahead is hit by who flies straight on: no reason to call that good."""
    easy = TaskSettings(
        num_cubes=1, first_distance=8.0, front_margin=4.0, cube_size=4.0, lateral_bound=0.5
    )
    prober = make_prober(subject(Blind(0), easy), 200)
    assert prober.plain["success"] == 1.0
    assert not prober.plain["good"]
    found = prober.search(AXES["object_color"])
    assert (found["low"], found["high"], found["tests"]) == (None, None, 0)


def test_one_who_is_wrong_on_a_side_is_surely_bad(make_prober):
    prober = make_prober(subject(Blind(1)), 200)
    assert prober.plain["bad"] and not prober.plain["good"]
    assert prober.plain["worst"]["share"] < 0.2


def test_sizes_that_cannot_be_are_not_good(make_prober):
    probed = make_prober(subject(), 1).probe(Condition(task={"cube_size": 9.0}))
    assert (probed["good"], probed["bad"]) == (False, True)
    assert "sinks cubes" in probed["refused"]


def test_good_is_what_is_surely_good_and_better_than_luck():
    rule = Rule()
    sure = {
        "success": Quantity(0.1, 0.05, 0.15, (0.0,)),
        **{f"offered {s}": Quantity(0.5, 0.4, 0.6, (0.05,)) for s in rule.strata},
        **{f"collected {s}": Quantity(0.9, 0.8, 1.0, (0.3, 0.7)) for s in rule.strata},
        **{f"above {name}": Quantity(0.5, 0.4, 0.6, (0.0,)) for name in rule.luck},
    }
    assert is_surely_good(sure, rule)
    for name, lower in (("success", -0.01), ("collected right", 0.69), ("above forward", -0.01)):
        assert not is_surely_good({**sure, name: sure[name]._replace(lower=lower)}, rule), name


def test_errors_are_shared_out_among_all_that_is_tried(make_prober):
    prober = make_prober(subject(), 1)
    assert prober._rule.error_rate == pytest.approx(0.05 / 13)
    assert dataclasses.replace(prober._rule, error_rate=0.05) == Rule()
    assert torch.equal(prober._oracle.success, torch.ones(1).double())
