"""Which certificate is found, and which is not believed."""

import json
import shutil

import pytest

import drone_rl
from drone_rl.collectors.complete_episodes import run_episodes
from drone_rl.policies.zoo import certificate_path
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import RootSeed
from drone_rl.verification.claim import find_claim
from tests.verification.checker.making import of_every_place, of_one_cube
from tests.verification.checker.tampering import tampered


@pytest.fixture(scope="module")
def truth():
    return of_one_cube("poor")


@pytest.fixture
def poor(tmp_path):
    """A policy in a file of its own, in the task of one cube."""
    path = tmp_path / "mine.safetensors"
    shutil.copy(drone_rl.load_policy("poor").path, path)
    return drone_rl.load_policy(path).in_task(num_cubes=1)


def test_none_where_none_lies(poor):
    assert find_claim(poor) is None


def test_the_one_beside_an_exported_policy(poor, truth, tmp_path):
    path = tmp_path / "mine.certificate.json"
    path.write_text(json.dumps(truth))
    claim = find_claim(poor)
    assert claim.path == path
    assert (claim.certificate.outcomes[0].share, claim.refused) == (1.0, None)
    assert claim.flights == 1000 and claim.uniform >= 900 and not claim.seed_is_fixed
    assert claim.wrong_at_most < 0.0034
    unchecked = find_claim(poor, flights=0)
    assert (unchecked.flights, unchecked.wrong_at_most) == (0, None)


def test_the_one_in_the_folder_of_a_run(tmp_path):
    assert certificate_path(tmp_path / "checkpoints" / "last.pt") == tmp_path / "certificate.json"


def test_one_that_lies_there_and_is_not_believed_is_refused(poor, truth, tmp_path):
    path = tmp_path / "mine.certificate.json"
    path.write_text(json.dumps(truth))
    other = find_claim(poor.in_task(num_cubes=2))
    assert other.certificate is None and "another task: num_cubes=1, not 2" in other.refused
    path.write_text("{")
    assert "no plain JSON" in find_claim(poor).refused


def test_one_that_is_given_must_be_believed(poor, truth, tmp_path):
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


def test_flights_anew_find_a_lie_that_goes_together(poor, truth, tmp_path):
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


def test_a_certificate_that_lies_there_is_re_checked_unasked(poor, tmp_path):
    """A forged one, with numbers of steps as frequent as they are, next to the policy."""
    path = tmp_path / "mine.certificate.json"
    path.write_text(json.dumps(of_every_place(poor)))
    assert "ended otherwise than stated" in find_claim(poor).refused


def test_no_tampered_file_makes_a_poor_policy_proved(poor, truth, tmp_path):
    with poor.flying(20) as (env, actor):
        episodes = run_episodes(env, actor, 20)
    for name, content in tampered(truth).items():
        (tmp_path / "mine.certificate.json").write_bytes(content)
        quoted = find_claim(poor, flights=20).as_evidence(episodes)
        assert quoted["refused"] or not (quoted["every"] or quoted["lost"] < 1), name


def test_a_certificate_that_is_no_path_is_refused(poor):
    with pytest.raises(InputError, match=r"certificate=3 is no path"):
        find_claim(poor, 3)
