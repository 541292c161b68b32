"""Policies that memorise the environments of a known seed deceive no analysis by default."""

import pytest

import drone_rl
from drone_rl.api.progress import silent
from drone_rl.bench import gamed_memory
from drone_rl.bench.gamed_memory import EPISODES, by_frames, cases, judgements, record
from drone_rl.utils.seeding import Stream

NAMES = (
    "verdict, callable that looks frames up",
    "verdict, callable that counts steps",
    "evaluate, callable that looks frames up",
    "shifts, callable that looks frames up",
    "verdict, file of an MLP",
)


@pytest.fixture(scope="module")
def judged(tmp_path_factory):
    return judgements(tmp_path_factory.mktemp("memory"))


@pytest.mark.parametrize("name", NAMES)
def test_an_attack_works_with_the_seed_that_it_knows_and_no_other(name, judged):
    assert judged[name](0), "otherwise the test below shows nothing"
    assert not judged[name](None)


def test_every_judgement_is_a_case(judged, tmp_path):
    assert {case.name for case in cases(tmp_path)} == {f"memory: {name}" for name in judged}
    assert set(NAMES) < set(judged)


def test_a_verdict_from_a_fixed_seed_says_so_and_a_fresh_one_is_not_deceived():
    policy = gamed_memory._memorising(by_frames, Stream.REPORT)
    how = {"episodes": EPISODES, "sampled": False, "progress": silent}
    known, fresh = drone_rl.judge(policy, seed=0, **how), drone_rl.judge(policy, **how)
    assert (known.verdict.kind, known.verdict.exit_code) == ("good", 0)
    assert "Fixed seed 0: a policy could have been fitted to these environments." in str(known)
    assert "environments: seed 0 (fixed)" in str(known)
    assert fresh.verdict.exit_code != 0
    assert fresh.verdict.kind != "good"
    assert "Fixed seed" not in str(fresh)


def test_a_recording_holds_each_step_of_each_episode():
    recorded = record(3)
    lengths = recorded.episode.bincount()
    assert len(lengths) == 3
    assert len(recorded.frames) == len(recorded.actions) == lengths.sum()
