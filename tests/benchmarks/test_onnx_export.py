"""Agreement with ONNX: the largest difference, and the sum of differing actions."""

import pytest

from benchmarks import onnx_export
from benchmarks.onnx_export import bench_onnx
from drone_rl.trust.onnx_export import Agreement


def test_a_shipped_policy_agrees_with_its_onnx_model(tmp_path):
    found = bench_onnx(tmp_path / "models", quick=True)
    assert found["onnx_max_difference"] <= 1e-5
    assert found["onnx_actions_differ"] == 0
    assert found["onnx_frames"] == 10_000
    assert len([*(tmp_path / "models").glob("*.onnx")]) == 1


@pytest.mark.parametrize("quick", [True, False])
def test_the_largest_difference_and_the_sums_are_returned(tmp_path, monkeypatch, quick):
    found = iter([Agreement(10, 1e-7, 1), Agreement(20, 3e-7, 0), Agreement(5, 2e-7, 2)])
    monkeypatch.setattr(onnx_export, "policy_names", lambda: ["good", "poor", "proved"])
    monkeypatch.setattr(onnx_export, "export_onnx", lambda policy, target: next(found))
    figures = bench_onnx(tmp_path, quick)
    assert tuple(figures.values()) == ((1e-7, 1, 10) if quick else (3e-7, 3, 35))
