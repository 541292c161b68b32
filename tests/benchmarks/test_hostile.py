"""Malicious files are refused, and wrong reactions are detected."""

import math
import os
import re
import sys
from pathlib import Path

import pytest

from benchmarks import hostile
from benchmarks.hostile import SECRET
from tests.forked import run_module_forked


@pytest.mark.slow
def test_malicious_files_are_refused(tmp_path, monkeypatch):
    """A sample; the benchmark opens all files."""
    monkeypatch.setattr(hostile.subprocess, "run", run_module_forked)
    outcomes = hostile.run_all(tmp_path, every=31)
    assert len(outcomes) >= 12
    assert len({outcome["name"] for outcome in outcomes}) == len(outcomes)
    assert {o["name"]: o["wrong"] for o in outcomes if o["wrong"]} == {}


def refuse():
    sys.stderr.write("error: no\n")
    sys.exit(2)


def crash():
    raise TypeError("x")


def accept():
    sys.exit(0)


def warn():
    sys.stderr.write("warning\n")
    refuse()


def print_secret():
    sys.stdout.write(SECRET)
    refuse()


def write_secret():
    with open("left", "w") as file:
        file.write(SECRET)
    refuse()


def allocate():
    bytearray(2**31)
    refuse()


def grow():
    memory = bytearray(os.urandom(2**20)) * 1000
    memory[-1] = 1
    refuse()


def work():
    while sum(os.times()[:2]) < 30:
        pass


def die():
    os.kill(os.getpid(), 9)


@pytest.mark.parametrize(
    ("main", "wrong"),
    [
        (refuse, ""),
        (crash, "ended with status 1: .*TypeError"),
        (accept, "ended with status 0"),
        (warn, "printed 'warning"),
        (print_secret, "revealed the secret"),
        (write_secret, "revealed the secret"),
        (allocate, "ended with status 1: .*MemoryError"),
        (work, "(ended by signal 14|took)"),
        (die, "ended by signal 9"),
    ],
)
def test_wrong_reactions_are_detected(tmp_path, monkeypatch, main, wrong):
    monkeypatch.setattr(hostile, "TIMEOUT_S", 1)
    found = hostile._fork(main, ["x"], tmp_path)["wrong"]
    assert re.fullmatch(wrong + ".*" if wrong else "", found, re.S), found


def test_memory_growth_is_measured(tmp_path, monkeypatch):
    monkeypatch.setattr(hostile, "MAX_MEMORY", 2**29)
    monkeypatch.setattr(hostile, "MAX_SECONDS", math.inf)
    monkeypatch.setattr(hostile.resource, "setrlimit", lambda *args: None)
    found = hostile._fork(grow, ["x"], tmp_path)
    assert "MiB" in found["wrong"]
    assert found["mib"] > 900
    assert 0 < found["seconds"] < 30


def test_a_changed_canary_is_detected(tmp_path):
    (tmp_path / "a").write_text("a")
    before = hostile._snapshot(tmp_path)
    assert hostile._snapshot(tmp_path) == before
    (tmp_path / "a").write_text("b")
    changed = hostile._snapshot(tmp_path)
    assert changed != before
    (tmp_path / "b").touch()
    assert hostile._snapshot(tmp_path) != changed


def test_refused_files_are_counted(tmp_path, monkeypatch):
    refused = {"name": "a", "wrong": "", "mib": 7.0, "seconds": 0.5}
    outcomes = [refused, {"name": "b", "wrong": "it did", "mib": 3.0, "seconds": 1.5}]
    monkeypatch.setattr(hostile, "run_all", lambda folder: outcomes)
    assert hostile.bench_hostile(tmp_path) == {
        "hostile_refused": 1,
        "hostile_total": 2,
        "hostile_peak_mib": 7.0,
        "hostile_max_s": 1.5,
    }


def test_a_relative_folder_becomes_absolute(tmp_path, monkeypatch):
    commands = []
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(hostile.subprocess, "run", lambda command, **_: commands.append(command))
    (tmp_path / "outcomes.json").write_text("[]")
    hostile.run_all(Path("."), 3)
    assert commands[0][-2:] == [str(tmp_path), "3"]
