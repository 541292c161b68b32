"""New episodes that check what a file says of other conditions."""

import math

import numpy as np
import pytest

import drone_rl
from drone_rl.config.commands import JudgeSettings
from drone_rl.trust.axes import AXES
from drone_rl.trust.coverage import _strengths, recheck_domain
from drone_rl.trust.domain import Prober
from drone_rl.trust.rule import Rule
from drone_rl.utils.intervals import mean_bounds
from drone_rl.utils.seeding import RootSeed
from tests.trust.making import shifts_of

FEW = JudgeSettings(domain_flights=60)
SEED = RootSeed(3, True)


@pytest.fixture(scope="module")
def good():
    return drone_rl.load_policy("good").in_task(num_cubes=1)


def need(**ends):
    return {"low": None, "high": None, **ends}


def test_what_is_so_is_not_contradicted(good):
    found = recheck_domain(good, {"blur": need(high=0.5)}, shifts_of(good), FEW, SEED)
    assert found.contradictions == ()
    assert found.strengths["blur"][0] == 0.5 and found.count == 3
    assert all(0 < value < 0.5 for value in found.strengths["blur"][1:])
    assert "(fixed seed 3, to which a policy could have been fitted)" in str(found)
    assert "60 episodes at each of 3 strengths" in str(found)


def test_an_invented_range_is_contradicted(good):
    """Good, says the file, with twelve of 25 rows dead."""
    numbers = shifts_of(good, axes=("dead_rows",))
    found = recheck_domain(good, {"dead_rows": need(low=12.0, high=12.0)}, numbers, FEW, SEED)
    assert found.contradictions and all(
        line.startswith("dead rows at 12 rows: ") and "certainly not good there" in line
        for line in found.contradictions
    )


def test_a_poor_policy_is_contradicted_where_nothing_is_different():
    poor = drone_rl.load_policy("poor").in_task(num_cubes=1)
    found = recheck_domain(poor, {"blur": need(high=0.5)}, shifts_of(poor), FEW, SEED)
    assert found.contradictions[0].startswith("without perturbation: 0% of new episodes")


def test_a_fresh_seed_is_stated_as_such(good, monkeypatch):
    monkeypatch.setattr("drone_rl.trust.coverage.NUM_RANDOM_STRENGTHS", 0)
    few, seed = FEW.replace(domain_flights=2), RootSeed(8, False)
    found = recheck_domain(good, {"blur": need(high=0.5)}, shifts_of(good), few, seed)
    assert (found.seed, found.seed_is_fixed) == (8, False) and "(fresh seed 8" in str(found)


def test_with_fewer_successes_it_would_have_been_contradicted(good, monkeypatch):
    monkeypatch.setattr("drone_rl.trust.coverage.NUM_RANDOM_STRENGTHS", 0)
    found = recheck_domain(good, {"blur": need(high=0.5)}, shifts_of(good), FEW, SEED)
    confidence = 1 - 0.05 / 2 / len(Rule().quantities)  # two strengths, the neutral one included

    def upper(count):
        values = np.repeat([0.1, -0.9], [count, 60 - count])
        return mean_bounds(values, -0.9, 1.0, confidence)["upper95"]

    assert upper(found.fewest) > 0 >= upper(found.fewest - 1)


def test_all_strengths_share_the_error_probability(good, monkeypatch):
    parts = []

    class Noted(Prober):
        def probe(self, condition, part):
            parts.append(part)
            return super().probe(condition, part)

    monkeypatch.setattr("drone_rl.trust.coverage.Prober", Noted)
    few = FEW.replace(domain_flights=2)
    recheck_domain(good, {"blur": need(high=0.5)}, shifts_of(good), few, SEED)
    assert parts == [0.25] * 4  # without perturbation, at the end, and at two random strengths


@pytest.mark.parametrize("name", list(AXES))
def test_strengths_lie_within_what_is_needed(good, name):
    of, axis = good.description, AXES[name]
    value = axis.value(axis.strengths[1], of)
    numbers = shifts_of(good, axes=(name,))
    neutral = numbers["axes"][name]["neutral"]
    neutral = math.inf if neutral is None else neutral
    wanted = need(low=value) if value < neutral else need(high=value)
    found = [*_strengths(axis, of, wanted, numbers, np.random.default_rng(0))]
    values = [axis.value(strength, of) for strength in found]
    assert any(math.isclose(one, value) for one in values)
    low, high = sorted((value, neutral))
    assert all(low - 1e-9 <= one <= high + 1e-9 for one in values)
    assert len(found) == 3 or axis.whole
