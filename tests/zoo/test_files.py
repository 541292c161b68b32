import hashlib

import pytest
import torch

from drone_rl.utils.errors import InputError
from drone_rl.zoo import card_path, export_policy, load_exported, policy_names, policy_path

SHARE = {"share": 0.5, "lower95": 0.4, "upper95": 0.6}
EVALUATION = {
    "mean_cubes": 1.5,
    "episodes": 10,
    "success": SHARE,
    "shares": {"left": {"mean": None, "lower95": 0.0, "upper95": 1.0}},
}
CHECKPOINT = {
    "policy": {"layers.logits.weight": torch.arange(6.0).view(2, 3)},
    "config": {"policy": {"hidden": [3]}, "paths": {"outputs": "/home/somebody"}},
    "progress": {"frames": 1234},
    "provenance": {
        "versions": {"torch": "1", "torchrl": "2", "mujoco-warp": "3"},
        "git_revision": "abc",
        "machine": {"system": "here"},
    },
}


def test_what_is_exported_comes_back_without_traces_of_the_machine(tmp_path):
    path = tmp_path / "mine.safetensors"
    export_policy(path, CHECKPOINT, command="drone-rl train", evaluation=EVALUATION)
    found = load_exported(path)
    torch.testing.assert_close(found["policy"], CHECKPOINT["policy"])
    assert found["config"] == {"policy": {"hidden": [3]}}
    assert found["command"] == "drone-rl train"
    assert b"somebody" not in path.read_bytes()
    card = path.with_suffix(".md").read_text()
    assert hashlib.sha256(path.read_bytes()).hexdigest() in card
    assert "1,234 frames" in card and "0.500 (95%: 0.400 to 0.600)" in card
    assert "| share collected: left | not offered |" in card


@pytest.mark.parametrize("content", [b"", b"not a policy at all"])
def test_a_damaged_file_is_refused(tmp_path, content):
    (tmp_path / "x.safetensors").write_bytes(content)
    with pytest.raises(InputError, match=r"x\.safetensors can't be read"):
        load_exported(tmp_path / "x.safetensors")


def test_the_three_policies_travel_with_their_cards():
    assert {"good", "poor", "right_and_forward"} <= set(policy_names())
    for name in policy_names():
        path, card = policy_path(name), card_path(name).read_text()
        assert path.stat().st_size < 1_000_000
        assert hashlib.sha256(path.read_bytes()).hexdigest() in card
        assert load_exported(path)["command"] in card


def test_each_is_what_its_name_says():
    shares = {n: load_exported(policy_path(n))["evaluation"]["by_side"] for n in policy_names()}
    assert min(side["lower95"] for side in shares["good"].values()) > 0.95
    assert max(side["share"] for side in shares["poor"].values()) < 0.1
    assert shares["right_and_forward"]["right"]["lower95"] >= 0.8
    assert shares["right_and_forward"]["left"]["upper95"] <= 0.1
