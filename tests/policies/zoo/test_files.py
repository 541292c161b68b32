import hashlib
import json
import os
import shutil
from pathlib import Path

import pytest
import torch
from safetensors.torch import save

from drone_rl.policies.zoo import (
    PolicyDescription,
    TrainingProgress,
    certificate_path,
    find_policy,
    policy_names,
    policy_path,
    read_policy,
    shifts_path,
)
from drone_rl.policies.zoo.files import parse_checkpoint
from drone_rl.trust.export import export_policy
from drone_rl.trust.results import Verdict
from drone_rl.utils.checkpoint import save_checkpoint
from drone_rl.utils.errors import InputError
from tests.evidence import VERDICT
from tests.policies.zoo.test_description import DEFAULT

DESCRIPTION = {
    **DEFAULT,
    "network": {"name": "small_cnn", "patch": 4, "channels": [2], "hidden": []},
}
WEIGHTS = {
    name: torch.arange(float(value.numel())).reshape(value.shape)
    for name, value in PolicyDescription.read(DESCRIPTION).expected_weights().items()
}
PROGRESS = {"frames": 1234, "episodes": 9, "updates": 3, "seconds": 0.5, "running_reward": 1.0}
CHECKPOINT = {
    "policy": WEIGHTS,
    "config": {"paths": {"outputs": "/home/somebody"}},
    "description": DESCRIPTION,
    "progress": PROGRESS,
    "provenance": {
        "versions": {"torch": "1", "torchrl": "2", "mujoco-warp": "3"},
        "git_revision": "abc",
        "machine": {"system": "here"},
    },
}
ABOUT = {
    "progress": PROGRESS,
    "provenance": {"versions": {"torch": "1"}, "git_revision": None},
    "command": "drone-rl train",
    "verdict": VERDICT,
    "worlds": "report",
    "seed": 5,
    "chosen": {"runs": 3, "episodes": None},
}


def exported(weights=None, about=None, **metadata):
    """Return the content of an exported file."""
    policy = json.dumps({**ABOUT, **(about or {}), "description": DESCRIPTION})
    texts = {"format": "drone_rl policy", "policy": policy, **metadata}
    return save(WEIGHTS if weights is None else weights, texts)


def test_export_round_trip_has_no_machine_details(tmp_path):
    path = tmp_path / "mine.safetensors"
    origin = {"command": "drone-rl train", "seed": 5, "chosen": None}
    export_policy(path, parse_checkpoint(CHECKPOINT), verdict=Verdict.read(VERDICT), **origin)
    found = read_policy(path)
    torch.testing.assert_close(found.weights, WEIGHTS)
    assert found.description == PolicyDescription.read(DESCRIPTION)
    assert found.progress == TrainingProgress(**PROGRESS)
    assert {key: getattr(found, key) for key in origin} == origin
    assert (found.verdict["kind"], found.worlds) == ("none of these", "report")
    assert b"somebody" not in path.read_bytes()
    card = path.with_suffix(".md").read_text()
    assert hashlib.sha256(path.read_bytes()).hexdigest() in card
    assert "1,234 frames" in card and "**none of these**" in card and "(seed 5)" in card
    assert "three cubes of 2.5 m, up to 6 m" in card


def test_checkpoint_is_read_by_its_description(tmp_path):
    save_checkpoint(tmp_path / "a.pt", {**CHECKPOINT, "best": 0.5})
    found = read_policy(tmp_path / "a.pt")
    assert found.description == PolicyDescription.read(DESCRIPTION)
    assert found.training["best"] == 0.5
    torch.testing.assert_close(found.weights, WEIGHTS)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"\x02", "safetensors format"),
        (b"version https://git-lfs.github.com/spec/v1", "it is a Git LFS pointer; replace it by"),
        ((2**40).to_bytes(8, "little") + b"{}", "safetensors format"),
        (exported()[:-1], "weights are damaged"),
        (exported(format="drone_rl checkpoint"), "not a drone_rl policy"),
        (exported(about={"extra": 1}), "extra is unknown"),
        (exported(about={"command": "drone-rl train; rm -rf /"}), "must be a training command"),
        (exported(about={"verdict": {"a": "b\nc"}}), "verdict=.* must be plain data"),
        (exported({**WEIGHTS, "x": torch.zeros(1)}), "x' is .* absent by"),
        (exported(policy="{"), "its description is damaged"),
        (save(WEIGHTS, {"format": "drone_rl policy", "about": "{}"}), "drone-rl convert"),
    ],
)
def test_damaged_or_malicious_file_raises_one_line(tmp_path, content, message):
    (tmp_path / "x.safetensors").write_bytes(content)
    with pytest.raises(InputError, match=message) as error:
        read_policy(tmp_path / "x.safetensors")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"description": None}, "description=None"),
        ({"policy": 5}, "weights=5"),
        ({"progress": {"running_cubes": 1.0}}, r"progress\.running_cubes"),
        ({"provenance": {"versions": {"torch": "a\nb"}}}, "provenance"),
        ({"config": {"a": torch.zeros(3)}}, "config=.* must be plain data"),
    ],
)
def test_inconsistent_checkpoint_raises(tmp_path, change, message):
    save_checkpoint(tmp_path / "a.pt", {**CHECKPOINT, **change})
    with pytest.raises(InputError, match=message):
        read_policy(tmp_path / "a.pt")


def test_bundled_policies_have_cards():
    assert {"good", "poor", "right_and_forward", "proved"} <= set(policy_names())
    for name in policy_names():
        path = policy_path(name)
        card = path.with_suffix(".md").read_text()
        assert path.stat().st_size < 1_000_000
        assert hashlib.sha256(path.read_bytes()).hexdigest() in card
        assert read_policy(path).command in card
        assert b"_target_" not in path.read_bytes()


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("good", "good"),
        ("poor", "poor"),
        ("right_and_forward", "one-sided (right)"),
        ("proved", "good"),
        ("pillars_good", "good"),
        ("pillars_reckless", "poor"),
        ("pillars_timid", "poor"),
        ("flight", "good"),
        ("flight_wind", "good"),
        ("flight_velocity", "good"),
        ("flight_pillars", "good"),
        ("robust", "good"),
    ],
)
def test_bundled_policies_match_their_names(name, kind):
    found = read_policy(policy_path(name))
    assert (found.verdict["kind"], found.verdict["certain"]) == (kind, True)
    assert (found.worlds, found.verdict["greedy"]["episodes"]) == ("report", 1000)


def test_certificate_paths(tmp_path, monkeypatch):
    assert shifts_path(policy_path("good")).name == "good.shifts.json"
    assert certificate_path(policy_path("good")).name == "good.certificate.json"
    assert certificate_path(policy_path("good")).parent == policy_path("good").parent
    run = tmp_path / "run"
    assert certificate_path(run / "checkpoints" / "best.pt") == run / "certificate.json"
    monkeypatch.chdir(tmp_path)
    assert certificate_path(Path("last.pt")) == tmp_path.parent / "certificate.json"
    assert certificate_path(Path("/last.pt")) == Path("/certificate.json")


@pytest.mark.parametrize("where", ["mine.md", "mine.shifts.json"])
def test_failed_export_writes_nothing(tmp_path, where):
    (tmp_path / where).mkdir()
    path, carried = tmp_path / "mine.safetensors", {tmp_path / "mine.shifts.json": b"{}"}
    origin = {"command": "drone-rl train", "seed": 5, "chosen": None, "carried": carried}
    with pytest.raises(InputError, match=rf"{where}.*free some space"):
        policy = parse_checkpoint(CHECKPOINT)
        export_policy(path, policy, verdict=Verdict.read(VERDICT), **origin)
    assert [found.name for found in tmp_path.iterdir()] == [where]


def test_latest_and_folders_are_resolved(tmp_path):
    runs = tmp_path / "train" / "runs"
    for number, name in enumerate(("b", "a")):
        (runs / name / "checkpoints").mkdir(parents=True)
        shutil.copy(policy_path("good"), runs / name / "checkpoints" / "last.pt")
        os.utime(runs / name / "checkpoints" / "last.pt", (number, number))
    assert find_policy("latest", tmp_path) == runs / "a" / "checkpoints" / "last.pt"
    assert find_policy(runs / "b") == runs / "b" / "checkpoints" / "last.pt"
