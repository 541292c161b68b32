"""Where an exported policy says that it comes from."""

import dataclasses
import json

import pytest

import drone_rl
from drone_rl.config.commands import HeldOutSettings
from drone_rl.policies.zoo import certificate_path
from drone_rl.sweeps.manifest import Run, Sweep
from drone_rl.sweeps.rows import choice_in_sweep
from drone_rl.trust.coverage import find_domain
from drone_rl.trust.export import export, recorded_origin
from drone_rl.utils.errors import InputError
from drone_rl.verification.claim import find_claim
from tests.sweeps.conftest import _verdict
from tests.trust.making import shifts_of
from tests.verification.checker.making import of_every_place

METRICS = "frames,train/running_reward\n100,1.5\n"
FIGURES = {"frames": 100, "episodes": 9, "seconds": 1.0, "running_reward": 1.5, "num_cubes": 3}


@pytest.fixture
def checkpoint(tmp_path):
    """The last checkpoint of the second of three runs of a sweep."""
    runs = [
        Run(i, (f"seed={i}", "sweep=seeds", "trial=4"), tmp_path / f"run_{i}") for i in range(3)
    ]
    Sweep(tmp_path, "drone-rl train sweep=seeds", {}, runs).save()
    folder = runs[1].folder
    (folder / ".hydra").mkdir(parents=True)
    (folder / ".hydra" / "overrides.yaml").write_text("[seed=1]")
    (folder / "metrics.csv").write_text(METRICS)
    return folder / "checkpoints" / "last.pt"


def judged(checkpoint, **verdict):
    result = {"reason": "frames", **FIGURES, "verdict": _verdict("good", **verdict)}
    (checkpoint.parents[1] / "result.json").write_text(json.dumps(result))


def test_a_run_of_a_sweep_names_the_run_and_not_the_sweep(checkpoint):
    judged(checkpoint)
    command, chosen = choice_in_sweep(checkpoint)
    assert command == "drone-rl train seed=1 sweep=seeds hydra.mode=RUN"
    assert chosen == {"runs": 3, "episodes": 200}


def test_a_run_that_no_present_rule_has_judged_was_not_chosen_by_episodes(checkpoint):
    assert choice_in_sweep(checkpoint)[1] == {"runs": 3, "episodes": None}
    judged(checkpoint, rule="of yore")
    assert choice_in_sweep(checkpoint)[1] == {"runs": 3, "episodes": None}


def test_a_run_alone_is_named_by_its_own_settings(checkpoint):
    (checkpoint.parents[2] / "sweep.json").unlink()
    assert choice_in_sweep(checkpoint) is None
    assert recorded_origin(checkpoint, {}) == ("drone-rl train seed=1", None)


def test_what_an_exported_file_says_of_its_origin_goes_on(checkpoint):
    said = {"command": "drone-rl train seed=9", "chosen": {"runs": 7, "episodes": 20}}
    found = recorded_origin(checkpoint.with_suffix(".safetensors"), said)
    assert found == (said["command"], said["chosen"])


FEW = HeldOutSettings(episodes=4)
ONE = {"num_cubes": 1}
"""A task with short episodes."""


def test_a_card_quotes_a_certificate_that_then_travels_with_the_policy(tmp_path):
    policy = drone_rl.load_policy("proved")
    made = certificate_path(policy.path)
    target = tmp_path / "mine.safetensors"
    export(policy, target, FEW, certificate=made, find_claim=find_claim)
    card = (tmp_path / "mine.md").read_text()
    assert "A certificate states for every placement" in card
    assert "re-checked by 1,000 rollouts from fresh placements" in card
    assert "All figures except those of the certificate are from 4 episodes" in card
    beside = tmp_path / "mine.certificate.json"
    assert beside.read_bytes() == made.read_bytes()
    again = drone_rl.load_policy(target)
    assert find_claim(again, flights=20).flights == 20


def test_a_card_quotes_no_certificate_that_rollouts_refute(tmp_path):
    policy, made = drone_rl.load_policy("poor").in_task(**ONE), tmp_path / "made.json"
    made.write_text(json.dumps(of_every_place(policy)))
    target = tmp_path / "mine.safetensors"
    with pytest.raises(InputError, match="ended otherwise than stated"):
        export(policy, target, FEW, certificate=made, find_claim=find_claim)
    assert not target.exists()


def test_a_certificate_of_another_is_no_word_of_a_card(tmp_path):
    poor, good = (drone_rl.load_policy(name).in_task(**ONE) for name in ("poor", "good"))
    policy, target = poor, tmp_path / "mine.safetensors"
    beside = tmp_path / "mine.certificate.json"
    beside.write_text(json.dumps(of_every_place(good)))
    with pytest.raises(InputError, match="network with hash"):
        export(policy, target, FEW, certificate=beside, find_claim=find_claim)
    export(policy, target, FEW)
    export(drone_rl.load_policy(target), tmp_path / "again.safetensors", FEW)
    assert "ertificate" not in (tmp_path / "again.md").read_text()
    assert not (tmp_path / "again.certificate.json").exists()


@pytest.mark.parametrize(("name", "is_good"), [("good", True), ("right_and_forward", False)])
def test_a_card_quotes_conditions_that_then_travel_with_the_policy(tmp_path, name, is_good):
    """Those of one whom the card's verdict surely finds to be something else are not believed."""
    policy, made = drone_rl.load_policy(name).in_task(**ONE), tmp_path / "made.json"
    made.write_text(json.dumps(shifts_of(policy)))
    settings = dataclasses.replace(FEW, episodes=4 if is_good else 300, num_envs=300)
    export(policy, tmp_path / "mine.safetensors", settings, shifts=made)
    card = (tmp_path / "mine.md").read_text()
    assert ("with blur of up to 1 pixels and up to 4 dead rows" in card) == is_good
    assert "nothing is known of other colors, light or sizes" in card
    beside = tmp_path / "mine.shifts.json"
    assert beside.exists() == is_good
    if is_good:
        assert beside.read_bytes() == made.read_bytes()
        again = drone_rl.load_policy(tmp_path / "mine.safetensors")
        assert find_domain(again).path == beside
        assert "Read from mine.shifts.json, dated" in card  # and no path of this machine


def test_a_run_from_python_names_no_command(checkpoint):
    (checkpoint.parents[2] / "sweep.json").unlink()
    (checkpoint.parents[1] / ".hydra" / "overrides.yaml").unlink()
    assert recorded_origin(checkpoint, {}) == (None, None)


def test_a_checkpoint_is_not_believed_about_its_origin(checkpoint):
    (checkpoint.parents[2] / "sweep.json").unlink()
    lie = {"command": "drone-rl train seed=9", "chosen": {"runs": 1, "episodes": None}}
    assert recorded_origin(checkpoint, lie) == ("drone-rl train seed=1", None)


def test_the_command_of_a_resumed_run_repeats_all_of_it(checkpoint):
    (checkpoint.parents[2] / "sweep.json").unlink()
    noted = checkpoint.parents[1] / ".hydra" / "overrides.yaml"
    noted.write_text("[seed=1, resume=outputs/a, trainer.total_frames=9]")
    command, _ = recorded_origin(checkpoint, {})
    assert command == "drone-rl train seed=1 trainer.total_frames=9"


def test_a_wrong_command_is_refused_before_any_episode(tmp_path, monkeypatch):
    monkeypatch.setattr("drone_rl.trust.export.judge_policy", lambda *_, **__: 1 / 0)
    settings = HeldOutSettings(episodes=2)
    with pytest.raises(InputError, match="command="):
        export(
            drone_rl.load_policy("good"), tmp_path / "a.safetensors", settings, command="rm -rf /"
        )
