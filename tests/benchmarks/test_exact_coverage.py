"""Coverage of intervals of verdicts, by hand."""

import pytest

from benchmarks import exact_coverage
from benchmarks.exact_coverage import Truth


@pytest.mark.parametrize(
    ("success", "undecided", "held"),
    [
        (0.5, 0.0, True),
        (0.6, 0.0, True),  # intervals are closed
        (0.4, 0.0, True),
        (0.61, 0.0, False),
        (0.39, 0.0, False),
        (0.39, 0.02, True),  # undecided placements can move the rate into the interval
        (0.3, 0.05, False),
    ],
)
def test_an_interval_covers_every_possible_rate(success, undecided, held):
    assert Truth(success, undecided).is_covered({"lower95": 0.4, "upper95": 0.6}) == held


def test_reasons_to_leave_out_a_policy():
    assert exact_coverage._reason_to_leave_out(Truth(0.5, 0.0), [0.3, 0.6]) is None
    assert exact_coverage._reason_to_leave_out(Truth(0.5, 0.0), [0.3, 0.50005]) == "as another"
    assert (
        exact_coverage._reason_to_leave_out(Truth(1.0, 0.0), [])
        == exact_coverage._reason_to_leave_out(Truth(0.0, 0.0), [])
        == "always or never"
    )
    assert exact_coverage._reason_to_leave_out(Truth(0.9, 2e-4), []) == "undecided"


def test_coverage_counts_verdicts():
    rows = [
        {"policy": "a", "held": 19, "verdicts": 20},
        {"policy": "b", "held": 20, "verdicts": 20},
    ]
    found = exact_coverage.count(rows)
    assert found["verdict_coverage_exact"] == pytest.approx(39 / 40)
    held, total = (found[f"verdict_coverage_exact_{k}"] for k in ("held", "total"))
    assert (held, total) == (39, 40)
    assert found["verdict_coverage_exact_policies"] == rows


def test_the_quick_benchmark(tmp_path):
    """The policy right_and_forward collects cubes at y from -6 to 1.65 of -6 to 6."""
    found = exact_coverage.bench_exact_coverage(tmp_path, quick=True)
    assert found["verdict_coverage_exact_total"] == 3
    (row,) = found["verdict_coverage_exact_policies"]
    assert row["success"] + row["undecided"] / 2 == pytest.approx(7.65 / 12, abs=1e-4)
    assert row["held"] == found["verdict_coverage_exact_held"] >= 2


def test_checkpoints_of_all_stages_are_kept(tmp_path, monkeypatch):
    monkeypatch.setattr(exact_coverage, "SEEDS", range(1))
    monkeypatch.setattr(exact_coverage, "STAGES", (16, 32))
    named = dict(exact_coverage._policies(tmp_path, quick=False))
    assert list(named) == ["seed 0 after 16 episodes", "seed 0 after 32 episodes"]
    assert [p.state["progress"]["episodes"] for p in named.values()] == [16, 32]
    assert {p.task.num_cubes for p in named.values()} == {1}
