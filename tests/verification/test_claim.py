"""Certificates of policies: what episodes refute, and what only counts once it is proved here."""

import json
import shutil

import pytest

import drone_rl
from drone_rl.policies.zoo import certificate_path
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import RootSeed
from drone_rl.verification.claim import find_claim
from tests.verification.checker.making import of_every_place, of_one_cube


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
    claim = find_claim(poor, flights=1000)
    assert (claim.path, claim.refused, claim.computed) == (str(path), None, False)
    assert (claim.every, claim.share, claim.undecided) == (False, 0.0, 0.0)
    assert claim.checked == 1000 and not claim.seed_is_fixed
    # at most 20 episodes are at the box's 4 x 4 places, 62 at limits: 1 - 0.05 ** (1 / 918) = 0.33%
    assert 0.00299 < claim.wrong_at_most < 0.0034
    unchecked = find_claim(poor, flights=0)
    assert (unchecked.checked, unchecked.wrong_at_most) == (0, None)


def test_certificate_in_the_folder_of_a_run(tmp_path):
    assert certificate_path(tmp_path / "checkpoints" / "last.pt") == tmp_path / "certificate.json"


def test_invalid_certificate_next_to_a_policy_is_refused(poor, truth, tmp_path):
    path = tmp_path / "mine.certificate.json"
    path.write_text(json.dumps(truth))
    assert "another task: num_cubes=1, not 2" in find_claim(poor.in_task(num_cubes=2)).refused
    path.write_text("{")
    assert "is damaged" in find_claim(poor).refused


def test_given_certificate_must_be_valid(poor, truth, tmp_path):
    path = tmp_path / "certificate.json"
    path.write_text(json.dumps(truth))
    assert find_claim(poor, path, flights=20).path == str(path)
    assert find_claim(poor, tmp_path, flights=20).path == str(path)
    with pytest.raises(InputError, match="another task"):
        find_claim(poor.in_task(num_cubes=2), path)
    with pytest.raises(InputError, match="network with hash"):
        find_claim(drone_rl.load_policy("good").in_task(num_cubes=1), path)
    with pytest.raises(InputError, match=r"none\.json can't be read"):
        find_claim(poor, tmp_path / "none.json")


def test_episodes_contradict_a_consistent_lie(poor, truth, tmp_path):
    path = tmp_path / "certificate.json"
    path.write_text(json.dumps(truth))
    fixed = find_claim(poor, path, flights=20, seed=RootSeed(5, True))
    assert (fixed.checked, fixed.seed, fixed.seed_is_fixed) == (20, 5, True)
    path.write_text(json.dumps(of_every_place(poor)))
    assert find_claim(poor, path, flights=0).every  # only episodes can tell
    with pytest.raises(InputError, match=r"does not hold: from y=.* ended otherwise") as error:
        find_claim(poor, path, flights=20)
    assert "\n" not in str(error.value)


def test_certificate_next_to_a_policy_is_checked(poor, tmp_path):
    """A forged one, with numbers of steps as frequent as they are, next to the policy."""
    path = tmp_path / "mine.certificate.json"
    path.write_text(json.dumps(of_every_place(poor)))
    assert "ended otherwise than stated" in find_claim(poor).refused


def test_only_a_proof_computed_here_counts(poor, tmp_path):
    """The file states success from everywhere, and no episode tests it: the proof refutes it."""
    path = tmp_path / "mine.certificate.json"
    path.write_text(json.dumps(of_every_place(poor)))
    forged = find_claim(poor, flights=0, prove_again=True)
    assert not forged.computed and "a proof finds 0% of them" in forged.refused
    with pytest.raises(InputError, match="does not hold: it states success from every placement"):
        find_claim(poor, path, flights=0, prove_again=True)
    good = drone_rl.load_policy("good").in_task(num_cubes=1)
    path.write_text(json.dumps({**of_every_place(good), "computed": True}))
    with pytest.raises(InputError, match="computed is unknown"):  # no mark in a file counts
        find_claim(good, path, flights=0)
    path.write_text(json.dumps(of_every_place(good)))
    assert not find_claim(good, path, flights=20).computed
    assert find_claim(good, path, flights=20, prove_again=True).computed
