"""How far axes may go, by policies of which that is known, and by liars."""

import dataclasses

import numpy as np
import pytest
import torch

from drone_rl.config import TaskSettings
from drone_rl.envs.fault_models import dead_rows
from drone_rl.policies.baselines import OracleAgent
from drone_rl.trust import domain
from drone_rl.trust.axes import AXES, Axis
from drone_rl.trust.domain import Prober, is_surely_good
from drone_rl.trust.paired_evaluation import PairedEvaluator
from drone_rl.trust.perturbations import Condition
from drone_rl.trust.rule import Quantity, Rule
from drone_rl.trust.shifts_results import FailedEnd, Probe
from drone_rl.utils.intervals import mean_bounds
from tests.trust.subjects import Blind, Steering, subject


@pytest.fixture
def make_prober():
    beds = []

    def make(of, episodes=300):
        evaluator = PairedEvaluator(of, episodes)
        beds.append(evaluator)
        return Prober(
            evaluator,
            evaluator.run(Condition(), agent=OracleAgent()).episodes,
            0.9,
        )

    yield make
    for evaluator in beds:
        evaluator.close()


def _failed(axis, end, strength, probe):
    return FailedEnd(**dict(probe), end=end, value=strength)


def good_at(prober, is_good, monkeypatch):
    """Lets a policy be good at some strengths, whatever it is; notes what is asked."""
    asked = []

    def probe(condition, part):
        strength = condition.task["strength"]
        asked.append((strength, part))
        good = is_good(strength)
        return Probe(good=good, bad=not good, success=0.5)

    monkeypatch.setattr(prober, "probe", probe)
    monkeypatch.setattr(prober, "_explain", _failed)
    prober.plain = Probe(good=True)
    return asked


def axis(strengths, neutral=0.0, whole=False):
    return Axis(
        *("a", "b", "m", neutral, strengths),
        lambda s, _: Condition(task={"strength": s}),
        value=lambda s, _: 10 * s,
        whole=whole,
    )


def test_search_samples_strengths_between_those_of_the_table(make_prober, monkeypatch):
    prober = make_prober(subject(), 1)
    asked = good_at(prober, lambda s: -1.3 <= s <= 2.6, monkeypatch)
    found = prober.search(axis((1.0, -1.0, 2.0, -2.0, 4.0)))
    course = [s for s, part in asked if part == domain.WALKING]
    below, above = [s for s in course if s < 0], [s for s in course if s > 0]
    assert above[1] == 1.0 and 0 < above[0] < 1 < above[2] < 2 == above[3]
    assert below[1] == -1.0 and -1 < below[0] < 0 and above[0] == pytest.approx(-below[0])
    inside = [s for s, part in asked if part == domain.REFINING]
    assert inside and all(abs(s) > 1 for s in inside)
    assert found.positions == (
        min(s for s, _ in asked if s >= -1.3), max(s for s, _ in asked if s <= 2.6)
    )  # fmt: skip
    assert [found.low, found.high] == [10 * limit for limit in found.positions]
    assert [failed.end for failed in found.failed] == ["low", "high"]
    assert (found.low_open, found.high_open) == (False, False)
    assert [at.position for at in found.flown] == sorted(s for s, _ in asked)


def test_range_that_reaches_the_last_strength_is_open(make_prober, monkeypatch):
    prober = make_prober(subject(), 1)
    good_at(prober, lambda s: s <= 9, monkeypatch)
    found = prober.search(axis((1.0, 2.0, 3.0, 4.0, 5.0)))
    assert (found.low, found.high, len(found.flown)) == (0.0, 50.0, 10)
    assert (found.low_open, found.high_open, found.failed) == (None, True, ())


def test_policy_fitted_to_the_table_has_no_range(make_prober, monkeypatch):
    """Good at every strength that is written down, and nowhere else."""
    prober = make_prober(subject(), 1)
    table = (1.0, 2.0, 3.0, 4.0, 5.0)
    good_at(prober, lambda s: s in table, monkeypatch)
    found = prober.search(axis(table))
    assert (found.high, found.positions) == (0.0, (0.0, 0.0))


FLIGHTS = 400


def least_successes(part):
    """With how many of the flights a policy is surely good, beside an oracle that never fails."""
    confidence = 1 - part * Rule().error_rate / len(Rule().quantities)
    values = np.zeros(FLIGHTS)
    for count in range(360, FLIGHTS + 1):
        values[:count] = 1.0
        if mean_bounds(values - 0.9, -0.9, 1.0, confidence).lower95 > 0:
            return count
    raise AssertionError("nobody is good")


@pytest.mark.parametrize("dependence", ["none", "equal", "opposed"])
@pytest.mark.parametrize(
    "truth",
    [
        lambda s: 0.995 if s < 1.5 else 0.9,
        lambda s: 0.9 if 1 < s < 2 else 0.995,
        lambda s: 0.9,
        lambda s: 0.94 if s in (1, 2, 3, 4, 5) else 0.9,
    ],
    ids=["a border", "a hole", "nowhere", "between the strengths"],
)
def test_error_rate_of_ranges(make_prober, monkeypatch, truth, dependence):
    """Policies at the threshold itself, of whom nothing may be called good, a thousand times each.

    Flights at different strengths depend on one another in the same worlds, in one way or another.
    """
    prober, rng = make_prober(subject(), 1), np.random.default_rng(0)
    needed = {part: least_successes(part) for part in (domain.WALKING, domain.REFINING)}
    worlds, wrong = rng.random((1000, FLIGHTS)), 0
    flown = axis((1.0, -1.0, 2.0, 3.0, 4.0))
    for world in worlds:

        def is_good(condition, part, world=world):
            strength = condition.task["strength"]
            if dependence == "none":
                count = rng.binomial(FLIGHTS, truth(abs(strength)))
            else:
                turned = dependence == "opposed" and round(8 * abs(strength)) % 2
                count = int(((1 - world if turned else world) < truth(abs(strength))).sum())
            return Probe(good=bool(count >= needed[part]))

        good_at(prober, None, monkeypatch)
        monkeypatch.setattr(prober, "probe", is_good)
        low, high = prober.search(flown).positions
        held = [s for s in np.linspace(low, high, 200) if truth(abs(s)) <= 0.9]
        wrong += any(abs(s) > 0 for s in held)
    assert wrong <= 50  # far fewer: the rule's other quantities share the error, too


def test_parts_of_the_error_sum_to_one():
    gaps = 2 * len(axis((1.0, 2.0, 3.0, 4.0, 5.0)).strengths)
    assert 2 * domain.WALKING + gaps * domain.REFINING == pytest.approx(1.0)


def test_blind_policy_in_an_easy_task_has_no_range(make_prober):
    """A wide cube right ahead is hit by who flies straight on: no reason to call that good."""
    easy = TaskSettings(
        num_cubes=1, first_distance=8.0, front_margin=4.0, cube_size=4.0, lateral_bound=0.5
    )
    prober = make_prober(subject(Blind(0), easy), 200)
    assert prober.plain.success == 1.0
    assert not prober.plain.good
    found = prober.search(AXES["object_color"])
    assert (found.low, found.high, found.flown) == (None, None, ())


class Undecided(Steering):
    """Steers as well, by a lead that rounding can take away in some frames."""

    def __init__(self, darkest):
        super().__init__()
        self.darkest = darkest

    def forward(self, pixels):
        logits = super().forward(pixels)
        is_close = pixels.amin((-3, -2, -1), keepdim=True)[..., 0, 0] < self.darkest
        return torch.where(is_close, 1e-6 * logits, logits)


@pytest.mark.parametrize("darkest", [2.0, 0.0])
def test_fragile_episodes_count_as_failures(make_prober, darkest):
    prober = make_prober(subject(Undecided(darkest)), 200)
    assert prober.plain.success > 0.95 and not prober.plain.bad
    assert prober.plain.good == (darkest == 0.0)


def test_one_sided_policy_is_bad(make_prober):
    prober = make_prober(subject(Blind(1)), 200)
    assert prober.plain.bad and not prober.plain.good
    assert prober.plain.worst.share < 0.2


def quantity(value, lower, upper, *thresholds):
    return Quantity(value=value, lower=lower, upper=upper, thresholds=thresholds or (0.0,))


def test_certainly_good_needs_all_quantities():
    rule = Rule()
    sure = {
        "success": quantity(0.1, 0.05, 0.15),
        **{f"offered {s}": quantity(0.5, 0.4, 0.6, 0.05) for s in rule.strata},
        **{f"collected {s}": quantity(0.9, 0.8, 1.0, 0.3, 0.7) for s in rule.strata},
        **{f"above {name}": quantity(0.5, 0.4, 0.6) for name in rule.blind_baselines},
    }
    assert is_surely_good(sure, rule)
    for name, lower in (("success", -0.01), ("collected right", 0.69), ("above forward", -0.01)):
        assert not is_surely_good({**sure, name: sure[name].replace(lower=lower)}, rule), name


def test_baselines_run_under_the_condition_once_per_task(make_prober, monkeypatch):
    """Blind policies meet the task as it is changed, whatever the camera shows."""
    prober = make_prober(subject(), 4)
    flown, blindly = [], prober._evaluator.run_baselines
    monkeypatch.setattr(
        prober._evaluator,
        "run_baselines",
        lambda condition: flown.append(condition) or blindly(condition),
    )
    shorter = Condition(task={"step_length": 0.5})
    assert prober.probe(shorter, 1.0).refused is None
    prober.probe(dataclasses.replace(shorter, faults=(dead_rows(1),)), 1.0)
    prober.probe(Condition(), 1.0)
    assert flown == [shorter]
    lengths = [
        baselines["forward"].length.double().mean() for baselines in prober._baselines.values()
    ]
    assert lengths[1] > 1.8 * lengths[0]  # nearly twice as many steps to the boundary


def test_range_of_fog_ends_at_the_least_visibility(make_prober, monkeypatch):
    """Of fog the range is from the least visibility that is good up to clear air."""
    prober = make_prober(subject(), 1)
    fog = dataclasses.replace(
        AXES["fog"], make=lambda s, _: Condition(task={"strength": s}), own=None
    )
    good_at(prober, lambda s: s >= 30.0, monkeypatch)
    found = prober.search(fog)
    assert 30.0 <= found.low <= 40.0 and found.high is None
    assert found.positions[0] == 0.0 and found.positions[1] == pytest.approx(1 / found.low)
    assert (found.low_open, found.high_open) == (False, None)
    (failed,) = found.failed
    assert failed.end == "low" and 25.0 <= failed.value < 30.0


def test_impossible_strengths(make_prober):
    """With every row of the picture dead nobody sees a cube; in a little noise the oracle does."""
    prober = make_prober(subject(), 60)
    found = prober.probe(Condition(), domain.WALKING)
    blind = dataclasses.replace(
        AXES["dead_rows"], make=lambda s, _: Condition(faults=(dead_rows(5),))
    )
    told = prober._explain(blind, "high", 1.0, found)
    assert told.impossible and told.oracle.share < 0.9
    seen = prober._explain(AXES["noise"], "high", 2.0, found)
    assert not seen.impossible and seen.oracle.share == 1.0
    refused = prober._explain(AXES["noise"], "high", 2.0, found.replace(refused="so it is"))
    assert (refused.oracle, refused.impossible) == (None, False)
