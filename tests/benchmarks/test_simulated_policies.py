import numpy as np
import pytest

from benchmarks import simulated_policies
from benchmarks.simulated_policies import (
    A,
    L,
    R,
    SimulatedPolicy,
    _join,
    _mixture,
    judge_samples,
    policies,
)
from drone_rl.trust.rule import Rule, VerdictKind


def sampled(policy, episodes, draws):
    counts = np.random.default_rng(0).multinomial(episodes, policy.shares, draws)
    return judge_samples(policy, counts)


def test_types_and_their_probabilities():
    half = _mixture(0.25, (L, R), (1, 1), (0, 1))
    assert half.types == {((L, R), (1, 1), False): 0.25, ((L, R), (0, 1), False): 0.75}
    joined = _join((0.5, half), (0.5, _mixture(1.0, (A, A), (1, 1), (1, 1))))
    assert sum(joined.types.values()) == pytest.approx(1.0)
    assert joined.types[(L, R), (0, 1), False] == 0.375


def test_quantities_of_an_episode_type():
    policy = SimulatedPolicy({((L, A), (1, 0), False): 1.0}, forward_share=0.3)
    observed = dict(
        zip(Rule().quantities, (float(values[0]) for values in policy.observed), strict=True)
    )
    assert observed["success"] == pytest.approx(-0.9)
    assert (observed["offered left"], observed["offered right"]) == (1.0, 0.0)
    assert (observed["collected left"], observed["collected ahead"]) == (1.0, 0.0)
    assert np.isnan(observed["collected right"])
    assert observed["above random"] == pytest.approx(0.5 - 1 / 6)
    assert observed["above forward"] == pytest.approx(0.5 - 1 / 6 - 5 / 6 * 0.3)
    assert observed["unsolved by forward"] == pytest.approx(0.9)


def test_quantities_of_an_episode_that_flying_straight_solves():
    policy = SimulatedPolicy({((L, A), (1, 1), True): 1.0})
    names = Rule().quantities
    observed = {n: float(v[0]) for n, v in zip(names, policy.observed, strict=True)}
    assert observed["above forward"] == pytest.approx(0.0)
    assert observed["unsolved by forward"] == pytest.approx(-0.1)
    assert observed["unsolved by random"] == pytest.approx(0.9)
    assert policy.kind is VerdictKind.TRIVIAL


def test_policies_are_at_every_threshold_and_on_both_sides_of_it():
    kinds = {name: policy.kind for name, policy in policies().items()}
    for name in {name.rsplit(" ", 1)[0] for name in kinds}:
        assert len({kinds[f"{name} {shift}"] for shift in ("-0.03", "+0.03")}) == 2, name
    assert set(kinds.values()) >= {*VerdictKind} - {VerdictKind.ONE_SIDED_LEFT}
    assert kinds["all or nothing, success +0.00"] is VerdictKind.NONE  # exactly 0.9 is not more
    for policy in policies().values():
        assert policy.shares.sum() == pytest.approx(1.0)
        assert policy.shares.min() >= 0.0


def test_policies_far_from_thresholds_are_judged_correctly():
    perfect = _mixture(1.0, (L, A, R), (1, 1, 1), (1, 1, 1))
    assert sampled(perfect, 100, 1) == [VerdictKind.GOOD]
    assert sampled(perfect, 5, 1) == [None]
    one_sided = _mixture(0.99, (L, R), (0, 1), (0, 0))
    assert sampled(one_sided, 400, 20) == [VerdictKind.ONE_SIDED_RIGHT] * 20


def test_intervals_that_are_too_narrow_are_detected(monkeypatch):
    """At a true rate of 0.9, a rule that trusts the mean is often certain and wrong."""
    exact = simulated_policies.estimate

    def narrow(*args):
        found = exact(*args)
        middle = found.lower if found.value is None else found.value
        return found._replace(lower=middle - 0.001, upper=middle + 0.001)

    policy = policies()["all or nothing, success +0.00"]
    assert sampled(policy, 400, 100).count(VerdictKind.GOOD) == 0
    monkeypatch.setattr(simulated_policies, "estimate", narrow)
    assert sampled(policy, 400, 100).count(VerdictKind.GOOD) > 20
    monkeypatch.setattr(simulated_policies, "EPISODES", (400,))
    monkeypatch.setattr(simulated_policies, "policies", lambda: {"on the edge": policy})
    assert simulated_policies.bench_false_certain(quick=True)["false_certain_rate"] > 0.2
