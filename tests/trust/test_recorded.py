"""Where the newest verdict on a policy is found."""

import json
import os

import pytest

import drone_rl
from drone_rl.trust.recorded import (
    describe,
    read_verdicts,
    record_verdict,
    recorded_verdict,
)
from drone_rl.trust.results import Verdict
from drone_rl.utils.checkpoint import save_checkpoint
from tests.evidence import VERDICT


def verdict(kind):
    return Verdict.read({**VERDICT, "kind": kind})


@pytest.fixture
def trained(tmp_path):
    """A policy of a run that was judged at its end, 100 s after the epoch."""
    state = drone_rl.load_policy("poor").state
    folder = tmp_path / "train" / "runs" / "one"
    (folder / "checkpoints").mkdir(parents=True)
    plain = state.model_dump(include={"description", "progress", "provenance"})
    plain |= {"policy": state.weights, "config": {}}
    save_checkpoint(folder / "checkpoints" / "last.pt", plain)
    frames = state.progress.frames
    result = {"reason": "solved", "frames": frames, "largest_reward": 3}
    result["verdict"] = verdict("poor").as_dict()
    path = folder / "result.json"
    path.write_text(json.dumps(result))
    os.utime(path, (100, 100))
    return drone_rl.load_policy(folder)


def newest(policy, outputs):
    return recorded_verdict(policy, read_verdicts(outputs))


def record(policy, outputs, name, kind, when):
    folder = outputs / name
    folder.mkdir(parents=True)
    record_verdict(folder, policy, verdict(kind))
    os.utime(folder / "verdict.json", (when, when))


def test_the_newest_of_a_run_and_of_commands_counts(trained, tmp_path):
    assert describe(newest(trained, tmp_path)) == ("poor", "60.0% (58.0% to 62.0%)")
    record(trained, tmp_path, "verdict/runs/1", "good", 90)  # before the training ended
    assert newest(trained, tmp_path).kind == "poor"
    record(trained, tmp_path, "export/runs/1", "good", 110)
    assert newest(trained, tmp_path).kind == "good"
    record(trained, tmp_path, "explain/runs/1/0_one", "one-sided (left)", 120)
    assert newest(trained, tmp_path).kind == "one-sided (left)"


def test_verdicts_on_others_or_in_other_conditions_do_not_count(trained, tmp_path):
    record(drone_rl.load_policy("good"), tmp_path, "verdict/runs/1", "good", 200)
    record(trained.in_task(num_cubes=2), tmp_path, "verdict/runs/2", "good", 200)
    record(trained.in_dynamics(mode="simple_flight"), tmp_path, "verdict/runs/3", "good", 200)
    (tmp_path / "verdict" / "runs" / "4").mkdir()
    (tmp_path / "verdict" / "runs" / "4" / "verdict.json").write_text("[")
    assert newest(trained, tmp_path).kind == "poor"


def test_a_damaged_verdict_is_passed_over(trained, tmp_path):
    record(trained, tmp_path, "verdict/runs/1", "good", 110)
    record(trained, tmp_path, "verdict/runs/2", "poor", 120)
    path = tmp_path / "verdict" / "runs" / "2" / "verdict.json"
    path.write_text(path.read_text().replace('"poor"', '"splendid"', 1))
    assert newest(trained, tmp_path).kind == "good"


def test_a_judgement_is_found(tmp_path):
    done = drone_rl.judge("right_and_forward", episodes=50, outputs=tmp_path)
    (tmp_path / "verdict" / "runs" / "1").mkdir(parents=True)
    done.save(tmp_path / "verdict" / "runs" / "1" / "verdict.json")
    os.utime(tmp_path / "verdict" / "runs" / "1" / "verdict.json", (1e11, 1e11))
    policy = drone_rl.load_policy("right_and_forward")
    assert newest(policy, tmp_path).greedy.episodes == 50
