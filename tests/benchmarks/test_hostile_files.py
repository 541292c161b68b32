"""Malicious files differ from a valid one in one part only."""

import pytest

from benchmarks.hostile_files import (
    DESCRIPTION,
    changed,
    checkpoint_state,
    exported,
    hostile_files,
    weights,
)
from drone_rl.policies.zoo import load_exported, parse


def test_the_unchanged_file_is_accepted(tmp_path):
    path = tmp_path / "good.safetensors"
    path.write_bytes(exported())
    assert load_exported(path)["description"] == DESCRIPTION
    assert checkpoint_state()["policy"].keys() == weights().keys()


def test_changed_replaces_or_removes_one_value_in_a_copy():
    assert changed("task.spacing", 1.5)["task"] == {**DESCRIPTION["task"], "spacing": 1.5}
    assert changed("network.channels.0", 9)["network"]["channels"] == [9]
    assert "camera" not in changed("camera", ...)
    assert DESCRIPTION["task"]["spacing"] == 9.0
    assert parse(DESCRIPTION)


@pytest.fixture(scope="module")
def cases(tmp_path_factory):
    folder = tmp_path_factory.mktemp("hostile") / "here"
    return folder, hostile_files(folder)


def test_each_case_has_a_name_a_command_and_a_reason(cases):
    _, found = cases
    assert len(found) > 150
    assert len({name for name, *_ in found}) == len(found)
    assert all(command and why for _, command, why in found)


def test_the_canary_exists(cases):
    folder, _ = cases
    assert (folder / "canary" / "secret.txt").read_text()
    assert (folder / "canary" / "keep" / "me.txt").exists()
