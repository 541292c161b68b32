"""How far axes may go, by policies of which that is known, and whether ranges have holes."""

import dataclasses
from types import SimpleNamespace

import pytest
import torch

from drone_rl.config import TaskSettings
from drone_rl.envs.fault_models import dead_rows
from drone_rl.policies.baselines import OracleAgent
from drone_rl.trust import domain
from drone_rl.trust.axes import AXES, FACTORS, Axis
from drone_rl.trust.domain import Prober, is_surely_good, required_success, run_across
from drone_rl.trust.paired_evaluation import PairedEvaluator
from drone_rl.trust.perturbations import Condition
from drone_rl.trust.rule import Quantity, Rule
from drone_rl.trust.shifts_results import FailedEnd, Probe, RangeTest
from drone_rl.utils.errors import InputError
from drone_rl.utils.intervals import proportion
from tests.trust.subjects import Blind, Steering, subject


@pytest.fixture
def make_prober():
    beds = []

    def make(of, episodes=300):
        evaluator = PairedEvaluator(of, episodes)
        beds.append(evaluator)
        return Prober(evaluator, evaluator.run(Condition(), agent=OracleAgent()).episodes, 0.9)

    yield make
    for evaluator in beds:
        evaluator.close()


def never(_):
    raise AssertionError("a range was tested")


def _failed(axis, end, strength, probe):
    return FailedEnd(**dict(probe), end=end, value=strength)


def good_at(prober, monkeypatch, is_good, is_bad=None):
    """Lets a policy be good at some strengths, whatever it is; notes what is asked."""
    asked = []

    def probe(condition):
        strength = condition.task["strength"]
        asked.append(strength)
        good = is_good(strength)
        return Probe(good=good, bad=not good if is_bad is None else is_bad(strength), success=0.5)

    monkeypatch.setattr(prober, "probe", probe)
    monkeypatch.setattr(prober, "_explain", _failed)
    prober.plain = Probe(good=True)
    return asked


def axis(strengths=(1.0,), neutral=0.0, **more):
    return Axis(
        *("a", "b", "m", neutral, strengths),
        lambda s, _: Condition(task={"strength": s}),
        value=lambda s, _: 10 * s,
        **more,
    )


PASSED = RangeTest(success=proportion(200, 200), required=0.9)


def test_search_walks_outwards_and_divides_the_last_gap(make_prober, monkeypatch):
    prober, spans = make_prober(subject(), 1), []
    asked = good_at(prober, monkeypatch, lambda s: -1.3 <= s <= 2.6)
    flown = axis((1.0, -1.0, 2.0, -2.0, 4.0))
    found = prober.search(flown, lambda span: spans.append(span) or PASSED)
    assert asked == [-1.0, -2.0, -1.25, -1.5, 1.0, 2.0, 4.0, 2.5, 3.0]
    assert (found.low, found.high, found.positions) == (-12.5, 25.0, (-1.25, 2.5))
    assert (found.low_bad, found.high_bad) == (-15.0, 30.0)
    assert [failed.end for failed in found.failed] == ["low", "high"]
    assert (found.low_open, found.high_open) == (False, False)
    assert spans == [{flown: (-1.25, 2.5)}] and found.test == PASSED


def test_search_goes_on_to_where_the_policy_is_certainly_not_good(make_prober, monkeypatch):
    prober = make_prober(subject(), 1)
    good_at(prober, monkeypatch, lambda s: s <= 1, lambda s: s >= 3)
    found = prober.search(axis((1.0, 2.0, 3.0, 4.0)), lambda _: PASSED)
    assert (found.high, found.failed[0].value, found.high_bad) == (10.0, 2.0, 30.0)


def test_search_divides_a_gap_between_whole_strengths(make_prober, monkeypatch):
    prober = make_prober(subject(), 1)
    asked = good_at(prober, monkeypatch, lambda s: s <= 6)
    prober.search(axis((2.0, 8.0), whole=True), lambda _: PASSED)
    assert asked == [2.0, 8.0, 4.0, 5.0, 6.0]
    prober.search(axis((6.0, 7.0), whole=True), lambda _: PASSED)
    assert asked[5:] == [6.0, 7.0]


def test_range_that_reaches_the_last_strength_is_open(make_prober, monkeypatch):
    prober = make_prober(subject(), 1)
    good_at(prober, monkeypatch, lambda s: s <= 9)
    found = prober.search(axis((1.0, 2.0, 3.0, 4.0, 5.0)), lambda _: PASSED)
    assert (found.low, found.high) == (0.0, 50.0)
    assert (found.low_open, found.high_open, found.high_bad) == (None, True, None)
    assert found.is_wide


def test_range_of_a_single_strength_is_not_tested(make_prober, monkeypatch):
    prober = make_prober(subject(), 1)
    good_at(prober, monkeypatch, lambda s: False)
    found = prober.search(axis((1.0, 2.0)), never)
    assert found.positions == (0.0, 0.0) and not found.is_wide


@pytest.fixture
def across(monkeypatch):
    """The test of ranges for a policy that succeeds at strengths of which a function is true."""

    def test(succeeds, *axes, seed=0, episodes=200, required=0.9):
        class Evaluator:
            def __init__(self, *args):
                pass

            def sample(self, seed):
                pass

            def run(self, condition):
                is_success = succeeds(**condition.task)
                return SimpleNamespace(episodes=SimpleNamespace(success=torch.tensor([is_success])))

            def close(self):
                pass

        monkeypatch.setattr(domain, "PairedEvaluator", Evaluator)
        spans = {named(name): (0.0, 1.0) for name in axes}
        return run_across(subject(), spans, episodes, seed, required)

    return test


def named(name):
    made = axis(neutral=-1.0)
    return dataclasses.replace(made, name=name, make=lambda s, _: Condition(task={name: s}))


@pytest.mark.parametrize(
    ("succeeds", "axes"),
    [
        (lambda sun: not -0.6 < sun < -0.45, ["sun"]),  # from -1 to 0
        (lambda sun, fog: not (sun > -0.39 and fog > -0.39), ["sun", "fog"]),  # 15% of both
    ],
)
def test_holes_in_the_middle_and_joint_failures_are_found(across, succeeds, axes):
    found = [across(succeeds, *axes, seed=seed) for seed in range(40)]
    assert not any(one.is_passed for one in found)
    assert all(len(one.failed) == 3 for one in found)
    for values in found[0].failed:
        assert not succeeds(**{name: value / 10 for name, value in values.items()})


def test_a_hole_at_the_threshold_is_accepted_in_at_most_5_percent(across):
    accepted = sum(
        across(lambda sun: sun > -0.9, "sun", seed=seed).is_passed for seed in range(400)
    )
    assert 0 < accepted <= 20


def test_a_policy_that_never_fails_is_accepted(across):
    found = across(lambda sun: True, "sun")
    assert found.is_passed and found.failed == ()
    assert found.fails_at_most == pytest.approx(1 - 0.025 ** (1 / 200))


def test_strengths_that_the_task_refuses_are_not_passed(across):
    def refused(sun):
        raise InputError("too far")

    found = across(refused, "sun")
    assert not found.is_passed and found.refused == "too far"


def test_strengths_are_uniform_on_the_scale_of_the_axis():
    import numpy as np

    rng = np.random.default_rng(0)
    whole = [axis(whole=True).sample(0.0, 2.0, rng) for _ in range(300)]
    assert {*whole} == {0.0, 1.0, 2.0} and min(map(whole.count, {*whole})) > 70
    sizes = axis(neutral=1.0, scale=FACTORS)
    found = [sizes.sample(-np.log(4.0), 0.0, rng) for _ in range(300)]
    assert all(0.25 <= size <= 1.0 for size in found)
    assert 120 < sum(size < 0.5 for size in found) < 180


def test_ranges_are_tested_by_episodes_of_the_policy():
    found = run_across(subject(), {AXES["noise"]: (0.0, 2.0)}, 6, 1, 0.1)
    assert found.success.trials == 6 and found.success.successes >= 5
    blind = run_across(subject(Blind(1)), {AXES["noise"]: (0.0, 2.0)}, 6, 1, 0.1)
    assert blind.success.successes == 0 and [*blind.failed[0]] == ["noise"]


class OnlyInBatches(Steering):
    """Turns away from the target if it is called with one environment alone."""

    def forward(self, pixels):
        return (-1 if len(pixels) == 1 else 1) * super().forward(pixels)


def test_a_range_is_tested_one_environment_at_a_time(make_prober):
    of = subject(OnlyInBatches())
    assert make_prober(of).plain.success == 1.0
    assert run_across(of, {AXES["noise"]: (0.0, 2.0)}, 6, 1, 0.1).success.successes == 0


def test_required_success_is_relative_to_the_oracle(make_prober):
    oracle = make_prober(subject(), 50)._oracle
    assert required_success(oracle, 0.8) == pytest.approx(0.8)
    assert required_success(None, 0.8) == 0.8


def test_blind_policy_in_an_easy_task_has_no_range(make_prober):
    """A wide cube right ahead is hit by who flies straight on: no reason to call that good."""
    easy = TaskSettings(
        num_cubes=1, first_distance=8.0, front_margin=4.0, cube_size=4.0, lateral_bound=0.5
    )
    prober = make_prober(subject(Blind(0), easy), 200)
    assert prober.plain.success == 1.0
    assert not prober.plain.good
    found = prober.search(AXES["object_color"], never)
    assert (found.low, found.high, found.positions) == (None, None, None)


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
    assert prober.probe(shorter).refused is None
    prober.probe(dataclasses.replace(shorter, faults=(dead_rows(1),)))
    prober.probe(Condition())
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
    good_at(prober, monkeypatch, lambda s: s >= 30.0)
    found = prober.search(fog, lambda _: PASSED)
    assert 30.0 <= found.low <= 40.0 and found.high is None
    assert found.positions[0] == 0.0 and found.positions[1] == pytest.approx(1 / found.low)
    assert (found.low_open, found.high_open) == (False, None)
    (failed,) = found.failed
    assert failed.end == "low" and failed.value == 25.0 and 25.0 <= found.low_bad < 30.0


def test_impossible_strengths(make_prober):
    """With every row of the picture dead nobody sees a cube; in a little noise the oracle does."""
    prober = make_prober(subject(), 60)
    found = prober.probe(Condition())
    blind = dataclasses.replace(
        AXES["dead_rows"], make=lambda s, _: Condition(faults=(dead_rows(5),))
    )
    told = prober._explain(blind, "high", 1.0, found)
    assert told.impossible and told.oracle.share < 0.9
    seen = prober._explain(AXES["noise"], "high", 2.0, found)
    assert not seen.impossible and seen.oracle.share == 1.0
    refused = prober._explain(AXES["noise"], "high", 2.0, found.replace(refused="so it is"))
    assert (refused.oracle, refused.impossible) == (None, False)
