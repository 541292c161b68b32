import pytest

from benchmarks import flight_parity
from benchmarks.flight_parity import bench_flight_parity, manoeuvres, measure_parity


def test_manoeuvres_have_the_given_number_and_are_reproducible():
    one, again = manoeuvres(17, 0, 2.0), manoeuvres(17, 0, 2.0)
    assert sum(len(m.goals[0].values) for m in one) == 17 and len(one) == 15
    assert all(len(m.goals) == 2 for m in one)
    for first, second in zip(one, again, strict=True):
        assert first.name == second.name and first.settings == second.settings
        pairs = zip(first.goals, second.goals, strict=True)
        assert all((a.values == b.values).all() for a, b in pairs)
    assert (manoeuvres(17, 1, 2.0)[1].goals[0].values != one[1].goals[0].values).any()


def test_both_simulators_agree_for_a_second_of_each_kind():
    gaps = measure_parity(15, seconds=1.0)
    assert len({gap.name for gap in gaps}) == 15
    assert all(0 <= gap.metres < 1e-3 and 0 <= gap.degrees < 0.05 for gap in gaps)


def test_the_figures_are_the_largest_differences(monkeypatch):
    gaps = measure_parity(15, seconds=0.2)
    monkeypatch.setattr(flight_parity, "measure_parity", lambda *args, **how: gaps)
    figures = bench_flight_parity(quick=True)
    assert figures["flight_parity_m"] == max(m for m, _ in figures["flight_parity"].values())
    assert figures["flight_parity_deg"] == pytest.approx(0.0, abs=0.05)
