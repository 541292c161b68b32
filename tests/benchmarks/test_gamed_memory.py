"""Policies that memorise environments deceive an analysis only with the known seed."""

import functools

import pytest

import drone_rl
from benchmarks import gamed_memory
from benchmarks.gamed_memory import EPISODES, cases, frame_lookup, judgements, record, step_playback
from drone_rl.config import TaskSettings
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from drone_rl.utils.seeding import Stream

NAMES = (
    "evaluate, callable that looks frames up",
    "shifts, callable that looks frames up",
)


@pytest.fixture(scope="module", autouse=True)
def _small_and_recorded_once():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gamed_memory, "TASK", TaskSettings(num_cubes=1))
        patch.setattr(gamed_memory, "COUNTEREXAMPLES", 10)
        # little more than the 674 different frames, so that the fit has large weights
        patch.setattr(gamed_memory, "WIDTH", 690)
        patch.setattr(gamed_memory, "record", functools.cache(record))
        yield


@pytest.fixture(scope="module")
def judged(tmp_path_factory):
    return judgements(tmp_path_factory.mktemp("memory"))


@pytest.mark.parametrize("name", NAMES)
def test_an_attack_succeeds_with_the_known_seed_only(name, judged):
    assert judged[name](0), "the attack must succeed with the known seed"
    assert not judged[name](None)


def test_a_policy_that_counts_steps_is_refused_even_with_the_known_seed():
    policy = gamed_memory._memorising(step_playback, Stream.REPORT)
    with pytest.raises(InputError, match="depends on more than the frame"):
        drone_rl.judge(policy, seed=0, episodes=EPISODES, sampled=False, progress=silent)


def test_decisions_of_a_fitted_file_depend_on_rounding(tmp_path):
    path = gamed_memory.write_memorising_policy(tmp_path / "mlp.safetensors", stream=Stream.REPORT)
    options = {"episodes": EPISODES, "sampled": False, "progress": silent}
    known = drone_rl.judge(path, seed=0, **options)
    assert (known.verdict.kind, known.verdict.exit_code) == ("good", 13)
    assert "decisions depend on rounding" in str(known)


def test_every_analysis_has_a_case(judged, tmp_path):
    assert {case.name for case in cases(tmp_path)} == {f"memory: {name}" for name in judged}
    assert set(NAMES) < set(judged)


def test_a_verdict_states_a_fixed_seed_and_a_fresh_seed_is_not_deceived():
    policy = gamed_memory._memorising(frame_lookup, Stream.REPORT)
    options = {"episodes": EPISODES, "sampled": False, "progress": silent}
    known, fresh = drone_rl.judge(policy, seed=0, **options), drone_rl.judge(policy, **options)
    assert (known.verdict.kind, known.verdict.exit_code) == ("good", 0)
    assert "Fixed seed 0: a policy could have been fitted to these environments." in str(known)
    assert "environments: seed 0 (fixed)" in str(known)
    assert fresh.verdict.exit_code != 0
    assert fresh.verdict.kind != "good"
    assert "Fixed seed" not in str(fresh)


def test_a_recording_contains_every_step_of_every_episode():
    recorded = record(3)
    lengths = recorded.episode.bincount()
    assert len(lengths) == 3
    assert len(recorded.frames) == len(recorded.actions) == lengths.sum()
