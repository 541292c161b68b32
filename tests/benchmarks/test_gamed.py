from benchmarks import gamed, gamed_memory
from benchmarks.gamed_case import GamedCase
from benchmarks.registry import BENCHMARKS


def test_policies_that_are_judged_good_are_counted(monkeypatch, tmp_path):
    found = [GamedCase("a", lambda: True), GamedCase("b", lambda: False)]
    monkeypatch.setattr(gamed_memory, "cases", lambda folder: found)
    monkeypatch.setattr(gamed, "_MODULES", (gamed_memory,))
    assert gamed.bench_gamed(tmp_path) == {"gamed_verdicts": 1, "gamed_total": 2}
    assert BENCHMARKS["gamed"].group == "adversarial"
