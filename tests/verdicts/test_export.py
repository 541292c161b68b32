"""Where an exported policy says that it comes from."""

import dataclasses
import json

import pytest
import torch

import drone_rl
from drone_rl.config.commands import FlightSettings
from drone_rl.policies.zoo import certificate_path, open_onnx, parse
from drone_rl.sweeps.manifest import Sweep
from drone_rl.sweeps.runs import Run
from drone_rl.utils.errors import InputError
from drone_rl.verdicts import export as exporting
from drone_rl.verdicts.domains import find_domain
from drone_rl.verdicts.export import export, origin_of
from tests.robustness.making import shifts_of
from tests.sweeps.conftest import _verdict
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
    command, chosen = origin_of(checkpoint, {})
    assert command == "drone-rl train seed=1 sweep=seeds hydra.mode=RUN"
    assert chosen == {"runs": 3, "episodes": 200}


def test_a_run_that_no_present_rule_has_judged_was_not_chosen_by_episodes(checkpoint):
    assert origin_of(checkpoint, {})[1] == {"runs": 3, "episodes": None}
    judged(checkpoint, rule="of yore")
    assert origin_of(checkpoint, {})[1] == {"runs": 3, "episodes": None}


def test_a_run_alone_is_named_by_its_own_settings(checkpoint):
    (checkpoint.parents[2] / "sweep.json").unlink()
    assert origin_of(checkpoint, {}) == ("drone-rl train seed=1", None)


def test_what_an_exported_file_says_of_its_origin_goes_on(checkpoint):
    said = {"command": "drone-rl train seed=9", "chosen": {"runs": 7, "episodes": 20}}
    found = origin_of(checkpoint.with_suffix(".safetensors"), said)
    assert found == (said["command"], said["chosen"])


FEW = FlightSettings(episodes=4)


def test_a_card_quotes_a_certificate_that_then_travels_with_the_policy(tmp_path):
    policy = drone_rl.load_policy("proved")
    made = certificate_path(policy.path)
    target = tmp_path / "mine.safetensors"
    export(policy, target, FEW, certificate=made)
    card = (tmp_path / "mine.md").read_text()
    assert "A certificate states for every placement" in card
    assert "re-checked by 1,000 rollouts from fresh placements" in card
    assert "All figures but those of the certificate are of 4 episodes" in card
    beside = tmp_path / "mine.certificate.json"
    assert beside.read_bytes() == made.read_bytes()
    again = drone_rl.load_policy(target)
    assert drone_rl.judge(again, episodes=2, progress=lambda *_: None).verdict.is_proved


def test_a_card_quotes_no_certificate_that_rollouts_refute(tmp_path):
    policy, made = drone_rl.load_policy("poor"), tmp_path / "made.json"
    made.write_text(json.dumps(of_every_place(policy)))
    target = tmp_path / "mine.safetensors"
    with pytest.raises(InputError, match="ended otherwise than stated"):
        export(policy, target, FEW, certificate=made)
    assert not target.exists()


def test_a_certificate_of_another_is_no_word_of_a_card(tmp_path):
    policy, target = drone_rl.load_policy("poor"), tmp_path / "mine.safetensors"
    beside = tmp_path / "mine.certificate.json"
    beside.write_text(json.dumps(of_every_place(drone_rl.load_policy("good"))))
    with pytest.raises(InputError, match="network with the hash"):
        export(policy, target, FEW, certificate=beside)
    export(policy, target, FEW)
    export(drone_rl.load_policy(target), tmp_path / "again.safetensors", FEW)
    assert "ertificate" not in (tmp_path / "again.md").read_text()
    assert not (tmp_path / "again.certificate.json").exists()


@pytest.mark.parametrize(("name", "is_good"), [("good", True), ("right_and_forward", False)])
def test_a_card_quotes_conditions_that_then_travel_with_the_policy(tmp_path, name, is_good):
    """Those of one whom the card's verdict surely finds to be something else are not believed."""
    policy, made = drone_rl.load_policy(name), tmp_path / "made.json"
    made.write_text(json.dumps(shifts_of(policy)))
    settings = dataclasses.replace(FEW, episodes=4 if is_good else 300, num_envs=300)
    export(policy, tmp_path / "mine.safetensors", settings, shifts=made)
    card = (tmp_path / "mine.md").read_text()
    assert ("with blur of up to 1 pixels and up to 4 dead rows" in card) == is_good
    assert "nothing is known of other colours, light or sizes" in card
    beside = tmp_path / "mine.shifts.json"
    assert beside.exists() == is_good
    if is_good:
        assert beside.read_bytes() == made.read_bytes()
        again = drone_rl.load_policy(tmp_path / "mine.safetensors")
        assert find_domain(again).path == beside
        assert "Read from mine.shifts.json, dated" in card  # and no path of this machine


def test_an_onnx_model_that_agrees_is_left_with_its_command(tmp_path):
    target = tmp_path / "mine.onnx"
    found = drone_rl.export_onnx(drone_rl.load_policy("good"), target)
    assert found.frames == 10_000 and found.actions_differ == 0
    assert 0 < found.difference <= 1e-5
    assert b'"drone-rl train"' in target.read_bytes()
    assert [path.name for path in tmp_path.iterdir()] == ["mine.onnx"]


def test_an_onnx_model_is_of_the_policy_and_not_of_what_goes_wrong_in_its_camera(
    tmp_path, monkeypatch
):
    monkeypatch.setattr(exporting, "_STEPS", 3)
    policy = drone_rl.load_policy("good")
    described = policy.description.as_dict()
    described["transforms"].insert(1, {"name": "noise", "strength": 0.2, "correlation_time": 0.0})
    described["transforms"].insert(2, {"name": "late_frames", "frames": 2})
    trained = dataclasses.replace(policy, description=parse(described))
    assert drone_rl.export_onnx(trained, tmp_path / "mine.onnx").difference <= 1e-5
    drone_rl.export_onnx(policy, tmp_path / "clean.onnx")
    frames = torch.randint(0, 256, (2, 25, 64, 3), dtype=torch.uint8)
    models = [open_onnx((tmp_path / f"{n}.onnx").read_bytes()) for n in ("mine", "clean")]
    assert torch.equal(models[0](frames), models[1](frames))


@pytest.mark.parametrize("wrong", [1 / 3 + 1.1e-5, float("nan")])
def test_an_onnx_model_that_does_otherwise_is_not_left(tmp_path, monkeypatch, wrong):
    """A policy that always goes left is said to have one chance in three."""
    monkeypatch.setattr(exporting, "_STEPS", 3)
    monkeypatch.setattr(exporting, "make_onnx", lambda *_: b"a model")
    monkeypatch.setattr(exporting, "open_onnx", lambda _: lambda f: torch.full((len(f), 3), wrong))
    (tmp_path / "mine.onnx").write_text("an older one")
    with pytest.raises(InputError, match=r"differ by up to (0.67|nan).*format=safetensors"):
        drone_rl.export_onnx(drone_rl.load_policy("poor"), tmp_path / "mine.onnx")
    assert (tmp_path / "mine.onnx").read_text() == "an older one"


@pytest.mark.parametrize(("added", "is_left"), [(0.9e-5, True), (1.1e-5, False)])
def test_the_limit_is_one_in_a_hundred_thousand(tmp_path, monkeypatch, added, is_left):
    """A policy that surely goes left, whatever it sees."""
    always = torch.tensor([0.0, 1.0, 0.0], dtype=torch.float64)
    other = (always - added * always).expand(100, 3)
    monkeypatch.setattr(exporting, "_STEPS", 3)
    monkeypatch.setattr(exporting, "make_onnx", lambda *_: b"a model")
    monkeypatch.setattr(exporting, "open_onnx", lambda _: lambda f: other)
    policy = drone_rl.load_policy("poor")
    if is_left:
        assert drone_rl.export_onnx(policy, tmp_path / "m.onnx").difference < 1e-5
    else:
        with pytest.raises(InputError, match="1e-05 is allowed"):
            drone_rl.export_onnx(policy, tmp_path / "m.onnx")
    assert (tmp_path / "m.onnx").exists() == is_left


def test_a_place_for_an_onnx_model_that_is_none(tmp_path, monkeypatch):
    monkeypatch.setattr(exporting, "_STEPS", 3)
    monkeypatch.setattr(exporting, "MOST_DIFFERENCE", 2.0)
    monkeypatch.setattr(exporting, "make_onnx", lambda *_: b"a model")
    monkeypatch.setattr(exporting, "open_onnx", lambda _: lambda f: torch.zeros(len(f), 3))
    with pytest.raises(InputError, match=r"nowhere/m\.onnx can't be written"):
        drone_rl.export_onnx(drone_rl.load_policy("poor"), tmp_path / "nowhere" / "m.onnx")
