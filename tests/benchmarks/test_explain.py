import json

import pytest

from benchmarks import explain


@pytest.mark.parametrize(("quick", "frames"), [(True, 100), (False, 600)])
def test_figures_come_from_the_command_and_its_files(monkeypatch, tmp_path, quick, frames):
    calls = []

    def watch(*args):
        calls.append(args)
        run = tmp_path / "explain"
        (run / "0_good").mkdir(parents=True)
        numbers = {"class_model": {"logit": {"probabilities": [1.0, 0.9, 0.8]}}}
        (run / "0_good" / "explanation.json").write_text(json.dumps(numbers))
        (run / "report.html").write_bytes(bytes(2**19))
        return 12.5, 900.0

    monkeypatch.setattr(explain, "watch", watch)
    monkeypatch.setattr(explain, "_parts", lambda many: {"parts_of": many})
    found = explain.bench_explain(tmp_path, quick)
    assert found == {
        "explain_s": 12.5,
        "explain_peak_memory_mib": 900.0,
        "explain_frames": frames,
        "class_model_probability": [1.0, 0.9, 0.8],
        "report_mib": 0.5,
        "parts_of": 1000 if quick else 10_000,
    }
    assert calls[0][:2] == ("explain", "policy=good")
    assert ("frames=100" in calls[0]) is quick
