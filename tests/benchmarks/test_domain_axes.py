"""Required ranges on every axis, for a policy with known limits."""

import json

import pytest

import drone_rl
from benchmarks import domain_axes
from benchmarks.domain_axes import bench_domain_axes
from drone_rl.trust.axes import AXES
from drone_rl.trust.shifts import ranges_of
from tests.trust.making import shifts_of

robust = drone_rl.load_policy(domain_axes.POLICY)


class FakeShifts:
    """A result of `drone_rl.shifts` for a policy that is good up to the third strength."""

    def __init__(self, names):
        self.numbers = shifts_of(robust, axes=names)
        self.pictures = self.numbers["pictures"]

    def save(self, folder):
        (folder / "shifts.json").write_text(json.dumps(self.numbers))
        (folder / "domain.yaml").write_text(json.dumps(ranges_of(self.numbers)))


@pytest.fixture
def count(tmp_path, monkeypatch):
    find, found = domain_axes.find_domain, {}

    def find_once(policy, folder):
        if folder not in found:
            found[folder] = find(policy, folder)
        return found[folder]

    def run(result):
        found.clear()
        monkeypatch.setattr(domain_axes, "shifts", lambda *a, **k: result)
        monkeypatch.setattr(domain_axes, "find_domain", find_once)
        monkeypatch.setattr(
            domain_axes, "recheck_domain", lambda *a: type("R", (), {"contradictions": ()})
        )
        return bench_domain_axes(tmp_path / "bench", quick=True)

    return run


def test_every_axis_is_enforced_in_its_direction(count):
    found = count(FakeShifts(tuple(AXES)))
    assert found["domain_axes_wrong"] == {}
    assert found["domain_axes_right"] == found["domain_axes"] == len(AXES) == 22
    assert found["domain_axes_contradicted"] == []


def test_two_sided_axes_are_tested_at_both_ends(tmp_path, count):
    count(FakeShifts(("sun", "fog", "blur")))
    folder = tmp_path / "bench"
    tried = {
        name: {
            (end, is_inside)
            for needed, is_inside in domain_axes._ranges(robust, folder, name)
            for end in ("low", "high")
            if end in needed
        }
        for name in ("sun", "fog", "blur")
    }
    both = {(end, inside) for end in ("low", "high") for inside in (True, False)}
    assert tried["sun"] == both
    assert tried["fog"] == {("low", True), ("low", False)}
    assert tried["blur"] == {("high", True), ("high", False)}


def test_an_axis_that_is_enforced_in_the_wrong_direction_is_found(count, monkeypatch):
    """For example, a largest visibility in fog is required instead of a smallest one."""
    monkeypatch.setattr(
        "drone_rl.trust.coverage.lacking",
        lambda numbers, name, need: None if need["low"] is None else "reversed",
    )
    found = count(FakeShifts(("fog", "blur")))
    assert "the program's own file is refused" in found["domain_axes_wrong"]["fog"]
    assert found["domain_axes_right"] == 0
