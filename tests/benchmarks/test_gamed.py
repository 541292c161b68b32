from benchmarks import gamed, gamed_memory
from benchmarks.gamed_case import GamedCase
from benchmarks.registry import BENCHMARKS


def test_deceived_judgements_are_counted(monkeypatch, tmp_path):
    made = [GamedCase("a", lambda: True), GamedCase("b", lambda: False)]
    monkeypatch.setattr(gamed_memory, "cases", lambda folder: made)
    monkeypatch.setattr(gamed, "_MODULES", (gamed_memory,))
    assert gamed.bench_gamed(tmp_path) == {"gamed_verdicts": 1, "gamed_total": 2}
    assert BENCHMARKS["gamed"].group == "truth"
