"""Policies that deceive an analysis with a known seed, rounding or forged files do not succeed."""

import functools
import json

import pytest

import drone_rl
from benchmarks import gamed, gamed_certificates, gamed_memory, gamed_rounding
from drone_rl.config import TaskSettings
from drone_rl.policies.zoo import certificate_path
from drone_rl.trust.shifts import shifts
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from drone_rl.utils.seeding import Stream
from drone_rl.verification.prove import prove

FEW = {"episodes": gamed_memory.EPISODES, "sampled": False, "progress": silent}


@pytest.fixture(scope="module", autouse=True)
def _few_episodes():
    """Take fewer episodes and smaller tasks, with which honest policies are accepted."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gamed_memory, "TASK", TaskSettings(num_cubes=1))
        patch.setattr(gamed_memory, "COUNTEREXAMPLES", 10)
        # little more than the 674 different frames, so that the fit has large weights
        patch.setattr(gamed_memory, "WIDTH", 690)
        patch.setattr(gamed_memory, "record", functools.cache(gamed_memory.record))
        judge = functools.partial(
            drone_rl.judge, episodes=150, certificate_flights=400, domain_flights=30
        )
        patch.setattr(gamed_certificates, "judge", judge)
        narrow = {"task": {"num_cubes": 1, "lateral_bound": 0.1}}
        few = {"domain_episodes": 120}
        patch.setattr(gamed_rounding, "prove", lambda path, **how: prove(path, **{**how, **narrow}))
        patch.setattr(gamed_rounding, "shifts", lambda path, **how: shifts(path, **{**how, **few}))
        yield


def test_memorised_environments_deceive_with_the_known_seed_only(tmp_path):
    judgement = gamed_memory.judgements(tmp_path)["evaluate, callable that looks frames up"]
    assert judgement(0), "the attack must succeed with the known seed"
    assert not judgement(None)


def test_a_verdict_states_a_fixed_seed():
    policy = gamed_memory._memorising(gamed_memory.frame_lookup, Stream.REPORT)
    fixed, fresh = drone_rl.judge(policy, seed=0, **FEW), drone_rl.judge(policy, **FEW)
    assert (fixed.verdict.kind, fixed.verdict.exit_code) == ("good", 0)
    assert "Fixed seed 0: a policy could have been fitted to these environments." in str(fixed)
    assert fresh.verdict.kind != "good" and "Fixed seed" not in str(fresh)


def test_a_policy_that_counts_steps_is_refused():
    policy = gamed_memory._memorising(gamed_memory.step_playback, Stream.REPORT)
    with pytest.raises(InputError, match="depends on more than the frame"):
        drone_rl.judge(policy, seed=0, **FEW)


def test_decisions_of_a_fitted_file_depend_on_rounding(tmp_path):
    path = gamed_memory.write_memorising_policy(tmp_path / "mlp.safetensors")
    known = drone_rl.judge(path, seed=0, **FEW)
    assert (known.verdict.kind, known.verdict.exit_code) == ("good", 13)


@pytest.mark.parametrize(
    "name",
    [
        "proved for one cube by rounding",
        "in an operating domain by rounding",
        "bad one at a time",
    ],
)
def test_policies_that_depend_on_rounding_or_the_batch_are_not_good(name, tmp_path):
    assert not gamed_rounding.cases(tmp_path)[name]()


def test_non_finite_logits_are_an_error(tmp_path):
    with pytest.raises(InputError, match="non-finite action logits"):
        drone_rl.judge(gamed_rounding.non_finite(tmp_path), episodes=4)


@pytest.mark.parametrize(
    "name",
    [
        "a certificate of one box with plausible steps",
        "the certificate of another policy with this hash",
        "an invented operating domain",
        "flying straight in a trivial task",
    ],
)
def test_forged_files_and_trivial_tasks_are_not_good(name, tmp_path):
    assert not gamed_certificates.cases(tmp_path)[name]()


def test_honest_policies_are_proved(tmp_path):
    policy = gamed_certificates._copy_shipped("proved", tmp_path)
    certificate = gamed_certificates._honest_certificate()
    certificate_path(policy.path).write_text(json.dumps(certificate))
    judged = gamed_certificates.judge(policy, sampled=False, progress=silent)
    assert judged.status("proved") == 0
    assert gamed_rounding.proved("good")


def test_deceived_analyses_are_counted(setup, monkeypatch):
    for module in (gamed_memory, gamed_rounding, gamed_certificates):
        outcomes = {f"{module} fooled": lambda: True, f"{module} not": lambda: False}
        monkeypatch.setattr(module, "cases", lambda folder, outcomes=outcomes: outcomes)
    assert gamed.bench_gamed(setup) == {"gamed_verdicts": 3, "gamed_total": 6}
