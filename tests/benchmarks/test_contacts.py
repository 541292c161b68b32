"""The benchmark of the contact query notices errors of a millimetre."""

from pathlib import Path

import pytest

from benchmarks.worlds import contacts


def test_distances_agree_with_independent_ones(tmp_path: Path) -> None:
    """For primitives, convex and concave meshes, and a height field."""
    errors = {
        scene.name: contacts._largest_error(scene, 10)
        for scene in contacts._scenes(tmp_path)
        if scene.name not in ("indoor", "outdoor")
    }
    assert sorted(errors) == ["concave", "convex", "field", "primitives"]
    assert max(errors.values()) < 1e-5


def test_a_wrong_distance_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """If all distances were 2 mm too large."""
    scene = next(iter(contacts._scenes(tmp_path)))
    true = contacts.true_distances

    def shifted(*args):
        distances, is_known = true(*args)
        return distances - 0.002, is_known

    monkeypatch.setattr(contacts, "true_distances", shifted)
    assert contacts._largest_error(scene, 3) == pytest.approx(0.002, abs=1e-5)
