"""Ratio of the vector and the batched environment, with given rates."""

import sys

import pytest

from benchmarks import gymnasium as bench
from drone_rl.utils.errors import InputError

pytest.importorskip("gymnasium", reason="Gymnasium is not installed")


def test_the_same_frames_are_counted_on_both_sides(monkeypatch):
    calls = []

    def paired(first, second, seconds, rounds):
        calls.append((seconds, rounds))
        return first(), second(), 0.9

    monkeypatch.setattr(bench, "paired", paired)
    assert bench.bench_gymnasium(3, "cpu", quick=True) == {
        "gym_over_batched": 0.9,
        "gym_fps": 30,
        "batched_beside_gym_fps": 30,
    }
    bench.bench_gymnasium(2, "cpu", quick=False)
    assert calls == [(0.5, 1), (4.0, 9)]


def test_without_gymnasium_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "gymnasium", None)
    with pytest.raises(InputError, match=r"^drone-rl bench gymnasium needs .*-e '.\[gym\]'"):
        bench.bench_gymnasium(2, "cpu", quick=True)
