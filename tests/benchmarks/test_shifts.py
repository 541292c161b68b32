from benchmarks import shifts
from benchmarks.shifts import bench_shifts


def test_the_figures_of_quick_and_full_measurements(monkeypatch):
    calls = []

    class Done:
        numbers = {"axes": {"sun": 1, "blur": 2}}  # noqa: RUF012
        area = 0.75
        sentence = "Good."

    def evaluate(policy, _, **settings):
        calls.append((policy, settings.get("episodes")))
        return Done()

    monkeypatch.setattr(shifts, "shifts", evaluate)
    found = bench_shifts(quick=True)
    assert found.pop("shift_suite_s") >= 0
    assert found == {"shift_suite_axes": 2, "shift_area": 0.75}
    assert bench_shifts(quick=False)["shift_domain"] == "Good."
    assert calls == [("good", 20), ("good", 200), ("good", None)]
