"""What a verdict quotes of a certificate, held against the verdict's own flights, by hand."""

from pathlib import Path

import pytest
import torch

import drone_rl
from drone_rl.collectors.complete_episodes import CompleteEpisodes
from drone_rl.sim.tasks import CollectCubes
from drone_rl.sim.tasks.collect_cubes import CubeGoals, EndReason
from drone_rl.trust.rounding_sensitivity import Rounding
from drone_rl.verification.checker.certificate import parse_certificate
from drone_rl.verification.claim import Claim
from tests.verification.checker.making import of_every_place

PATH = Path("certificate.json")


def flown(places, ends):
    """Episodes of two cubes at these places, which collected all if they ended so."""
    y = torch.tensor(places, dtype=torch.float64)
    world = torch.stack([torch.tensor([15.0, 24.0]).expand_as(y), y, torch.full_like(y, 2.5)], -1)
    end = torch.tensor(ends)
    won = (end == EndReason.ALL_CUBES)[:, None].expand_as(y)
    goals = CubeGoals(
        reached=won,
        stratum=torch.zeros_like(won, dtype=torch.long),
        world=world.flatten(1),
        lateral=y,
        height=torch.zeros_like(y),
    )
    return CompleteEpisodes(CollectCubes(), goals, end, torch.full((len(y),), 30))


@pytest.fixture(scope="module")
def good():
    return drone_rl.load_policy("good").in_task(num_cubes=2)


def claim(policy, **how):
    return Claim(PATH, parse_certificate(of_every_place(policy, **how)))


ALL, BEHIND = EndReason.ALL_CUBES.value, EndReason.FRONT_BOUNDARY.value


def test_every_placement(good):
    found = claim(good).as_evidence(flown([[0.0, 1.0], [-6.0, 5.0], [2.0, 2.0]], [ALL] * 3))
    assert found == {
        "refused": None,
        "every": True,
        "share": 1.0,
        "lost": 0.0,
        "undecided": 0.0,
        "finished": True,
        "checked": 0,
        "wrong_at_most": None,
        "seed": None,
        "seed_is_fixed": True,
        "agreeing": 3,
    }


def test_what_is_undecided_is_not_proved_and_no_flight_speaks_against_it(good):
    some = claim(good, undecided=True).as_evidence(flown([[0.0, 1.0], [4.0, 5.0]], [ALL, BEHIND]))
    assert (some["every"], some["share"], some["undecided"]) == (False, 0.75, 0.25)
    assert some["agreeing"] == 1


def test_a_placement_that_float32_moves_across_a_border_speaks_neither_for_nor_against_it(good):
    """The cube stands at 3.0000001 m, where nothing is stated; the episode records 3 m."""
    place = float(torch.tensor(3.0000001, dtype=torch.float32))
    assert place == 3.0
    found = claim(good, undecided=True).as_evidence(
        flown([[place, 0.0], [2.0, 0.0]], [BEHIND, ALL])
    )
    assert (found["refused"], found["agreeing"]) == (None, 1)


def test_a_placement_that_float32_moves_out_of_bounds(good):
    place = float(torch.tensor(5.3, dtype=torch.float32))
    assert place > 5.3
    narrow = good.in_task(lateral_bound=5.3)
    found = claim(narrow).as_evidence(flown([[place, 0.0]], [ALL]))
    assert (found["refused"], found["agreeing"]) == (None, 1)


@pytest.mark.parametrize(("fragile", "is_refused"), [(20, False), (21, True)])
def test_a_proof_holds_for_any_order_of_sums(good, fragile, is_refused):
    found = Rounding("float32", True, 1000, fragile, 5, 1, "PyTorch", 5, 0, 0)
    evidence = claim(good).as_evidence(flown([[0.0, 1.0]], [ALL]), rounding=found)
    assert (evidence["refused"] is not None) == is_refused


def test_lost_placements(good):
    found = claim(good, end="front_boundary").as_evidence(flown([[0.0, 1.0]], [BEHIND]))
    assert (found["every"], found["share"], found["lost"]) == (False, 0, 1.0)


def test_one_flight_that_ends_otherwise_is_enough(good):
    places = [[0.0, 1.0], [1.0, 5.0], [2.0, 2.0]]
    found = claim(good).as_evidence(flown(places, [ALL, BEHIND, ALL]))
    assert found == {
        "refused": "1 of 3 greedy flights of this verdict ended otherwise than it states"
    }
    side = EndReason.SIDE_BOUNDARY.value
    lost = claim(good, end="front_boundary").as_evidence(flown(places[:1], [side]))
    assert lost["refused"] is not None


def test_other_cubes_than_stated_are_another_end(good):
    episodes = flown([[0.0, 1.0]], [BEHIND])
    episodes.goals.reached = torch.tensor([[True, False]])
    assert claim(good, end="front_boundary").as_evidence(episodes)["refused"] is not None


def test_what_was_refused_before_stays_so(good):
    assert Claim(PATH, None, "it is damaged").as_evidence(flown([[0.0, 1.0]], [ALL])) == {
        "refused": "it is damaged"
    }


def test_flights_anew_are_told(good):
    checked = Claim(
        PATH, claim(good).certificate, flights=7, uniform=5, seed=3, seed_is_fixed=False
    )
    told = checked.as_evidence(flown([[0.0, 1.0]], [ALL]))
    assert (told["checked"], told["seed"], told["seed_is_fixed"]) == (7, 3, False)
    assert told["wrong_at_most"] == pytest.approx(0.4507, abs=1e-4)  # 0.5493 ** 5 is 0.05


def test_what_re_checking_rules_out():
    """Of certificates that are wrong about the bound 5% pass: 1 - (1 - 0.00299) ** 1000 is 95%."""
    checked = Claim(PATH, None, flights=1200, uniform=1000)
    assert checked.wrong_at_most == pytest.approx(0.00299, abs=1e-5)
    assert (1 - checked.wrong_at_most) ** 1000 == pytest.approx(0.05)
    assert Claim(PATH, None).wrong_at_most is None
