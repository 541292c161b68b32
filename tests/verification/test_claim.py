"""What a verdict quotes of a certificate, held against the verdict's own flights, by hand."""

import json
import shutil
from pathlib import Path

import pytest
import torch

import drone_rl
from drone_rl.collectors.complete_episodes import CompleteEpisodes
from drone_rl.policies.zoo import certificate_path
from drone_rl.sim.tasks import CollectCubes
from drone_rl.sim.tasks.collect_cubes import CubeGoals, CubesEnd
from drone_rl.trust.results import Proof
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import RootSeed
from drone_rl.verification.checker.certificate import Certificate
from drone_rl.verification.claim import Claim, find_claim
from tests.verification.checker.making import of_every_place, of_one_cube

PATH = Path("certificate.json")


def flown(places, ends):
    """Episodes of two cubes at these places, which collected all if they ended so."""
    y = torch.tensor(places, dtype=torch.float64)
    world = torch.stack([torch.tensor([15.0, 24.0]).expand_as(y), y, torch.full_like(y, 2.5)], -1)
    end = torch.tensor(ends)
    won = (end == CubesEnd.ALL_CUBES)[:, None].expand_as(y)
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
    return Claim(PATH, Certificate.read(of_every_place(policy, **how)))


ALL, BEHIND = CubesEnd.ALL_CUBES.value, CubesEnd.FRONT_BOUNDARY.value


def test_certificate_of_every_placement(good):
    found = claim(good).quote(flown([[0.0, 1.0], [-6.0, 5.0], [2.0, 2.0]], [ALL] * 3))
    assert found == Proof(every=True, share=1.0, agreeing=3)


def test_undecided_placements(good):
    some = claim(good, undecided=True).quote(flown([[0.0, 1.0], [4.0, 5.0]], [ALL, BEHIND]))
    assert (some.every, some.share, some.undecided) == (False, 0.75, 0.25)
    assert some.agreeing == 1


def test_placements_at_a_border_do_not_count(good):
    """The cube stands at 3.0000001 m, where nothing is stated; the episode records 3 m."""
    place = float(torch.tensor(3.0000001, dtype=torch.float32))
    assert place == 3.0
    found = claim(good, undecided=True).quote(flown([[place, 0.0], [2.0, 0.0]], [BEHIND, ALL]))
    assert (found.refused, found.agreeing) == (None, 1)


def test_placements_rounded_out_of_bounds(good):
    place = float(torch.tensor(5.3, dtype=torch.float32))
    assert place > 5.3
    narrow = good.in_task(lateral_bound=5.3)
    found = claim(narrow).quote(flown([[place, 0.0]], [ALL]))
    assert (found.refused, found.agreeing) == (None, 1)


def test_lost_placements(good):
    found = claim(good, end="front_boundary").quote(flown([[0.0, 1.0]], [BEHIND]))
    assert (found.every, found.share, found.lost) == (False, 0, 1.0)


def test_one_other_end_refuses_the_certificate(good):
    places = [[0.0, 1.0], [1.0, 5.0], [2.0, 2.0]]
    found = claim(good).quote(flown(places, [ALL, BEHIND, ALL]))
    why = "1 of 3 greedy flights of this verdict ended otherwise than it states"
    assert found == Proof(refused=why)
    side = CubesEnd.SIDE_BOUNDARY.value
    lost = claim(good, end="front_boundary").quote(flown(places[:1], [side]))
    assert lost.refused is not None


def test_other_cubes_are_another_end(good):
    episodes = flown([[0.0, 1.0]], [BEHIND])
    episodes.goals.reached = torch.tensor([[True, False]])
    assert claim(good, end="front_boundary").quote(episodes).refused is not None


def test_rechecking_rollouts_are_reported(good):
    checked = Claim(
        PATH, claim(good).certificate, flights=7, uniform=5, seed=3, seed_is_fixed=False
    )
    told = checked.quote(flown([[0.0, 1.0]], [ALL]))
    assert (told.checked, told.seed, told.seed_is_fixed) == (7, 3, False)
    assert told.wrong_at_most == pytest.approx(0.4507, abs=1e-4)  # 0.5493 ** 5 is 0.05


def test_bound_of_rechecking():
    """Of certificates that are wrong about the bound 5% pass: 1 - (1 - 0.00299) ** 1000 is 95%."""
    checked = Claim(PATH, None, flights=1200, uniform=1000)
    assert checked.wrong_at_most == pytest.approx(0.00299, abs=1e-5)
    assert (1 - checked.wrong_at_most) ** 1000 == pytest.approx(0.05)
    assert Claim(PATH, None).wrong_at_most is None


@pytest.fixture(scope="module")
def truth():
    return of_one_cube("poor")


@pytest.fixture
def poor(tmp_path):
    """A policy in a file of its own, in the task of one cube."""
    path = tmp_path / "mine.safetensors"
    shutil.copy(drone_rl.load_policy("poor").path, path)
    return drone_rl.load_policy(path).in_task(num_cubes=1)


def test_policy_without_a_certificate(poor):
    assert find_claim(poor) is None


def test_certificate_next_to_a_policy(poor, truth, tmp_path):
    path = tmp_path / "mine.certificate.json"
    path.write_text(json.dumps(truth))
    claim = find_claim(poor)
    assert claim.path == path
    assert (claim.certificate.outcomes[0].share, claim.refused) == (1.0, None)
    assert claim.flights == 1000 and claim.uniform >= 900 and not claim.seed_is_fixed
    assert claim.wrong_at_most < 0.0034
    unchecked = find_claim(poor, flights=0)
    assert (unchecked.flights, unchecked.wrong_at_most) == (0, None)


def test_certificate_in_the_folder_of_a_run(tmp_path):
    assert certificate_path(tmp_path / "checkpoints" / "last.pt") == tmp_path / "certificate.json"


def test_invalid_certificate_next_to_a_policy_is_refused(poor, truth, tmp_path):
    path = tmp_path / "mine.certificate.json"
    path.write_text(json.dumps(truth))
    other = find_claim(poor.in_task(num_cubes=2))
    assert other.certificate is None and "another task: num_cubes=1, not 2" in other.refused
    path.write_text("{")
    assert "is damaged" in find_claim(poor).refused


def test_given_certificate_must_be_valid(poor, truth, tmp_path):
    path = tmp_path / "certificate.json"
    path.write_text(json.dumps(truth))
    assert find_claim(poor, path, flights=20).path == path
    assert find_claim(poor, tmp_path, flights=20).path == path
    with pytest.raises(InputError, match="another task"):
        find_claim(poor.in_task(num_cubes=2), path)
    with pytest.raises(InputError, match="network with hash"):
        find_claim(drone_rl.load_policy("good").in_task(num_cubes=1), path)
    with pytest.raises(InputError, match=r"none\.json can't be read"):
        find_claim(poor, tmp_path / "none.json")


def test_rollouts_contradict_a_consistent_lie(poor, truth, tmp_path):
    path = tmp_path / "certificate.json"
    path.write_text(json.dumps(truth))
    assert find_claim(poor, path, flights=20).flights == 20
    fixed = find_claim(poor, path, flights=20, seed=RootSeed(5, True))
    assert (fixed.seed, fixed.seed_is_fixed) == (5, True)
    path.write_text(json.dumps(of_every_place(poor)))
    assert find_claim(poor, path, flights=0).certificate is not None  # only rollouts can tell
    with pytest.raises(InputError, match=r"does not hold: from y=.* ended otherwise") as error:
        find_claim(poor, path, flights=20)
    assert "\n" not in str(error.value)


def test_certificate_next_to_a_policy_is_rechecked(poor, tmp_path):
    """A forged one, with numbers of steps as frequent as they are, next to the policy."""
    path = tmp_path / "mine.certificate.json"
    path.write_text(json.dumps(of_every_place(poor)))
    assert "ended otherwise than stated" in find_claim(poor).refused
