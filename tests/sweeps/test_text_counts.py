"""Counts over a small summary, by hand."""

import pytest

from drone_rl.sweeps import text as sweep_counts

SOLVED, CENSORED = {"more_than": None}, {"more_than": 9.0}
SUMMARY = {
    "finished": 4,
    "failed": 1,
    "unfinished": 2,
    "groups": [
        {"ended": 7, "damaged": 1, "solved": {"successes": 3}, "frames_to_solve": SOLVED},
        {"ended": 6, "damaged": 1, "solved": {"successes": 0}, "frames_to_solve": CENSORED},
        {"ended": 0, "damaged": 0, "solved": {"successes": 0}, "frames_to_solve": SOLVED},
    ],
    "runs": [
        {"state": "finished", "verdict": "one-sided (left)", "certain": True, "entropy": 0.0099},
        {"state": "finished", "verdict": "one-sided (left)", "certain": False, "entropy": 0.01},
        {"state": "finished", "verdict": "one-sided (right)", "certain": True, "entropy": None},
        {"state": "finished", "verdict": "good", "certain": None, "entropy": 0.2},
        {"state": "failed", "verdict": None, "certain": None, "entropy": 0.001},
        {"state": "unfinished", "verdict": None, "certain": None, "entropy": None},
        {"state": "unfinished", "verdict": None, "certain": None, "entropy": None},
    ],
}  # fmt: skip


@pytest.mark.parametrize(
    ("name", "number"),
    [
        ("ended", 5),  # 7 runs, 2 of them unfinished
        ("solved", 3),
        ("unsolved", 2),  # 4 + 1 that ended, 3 solved
        ("few", 1),  # 6 - 1 damaged is fewer than 6; none at all is no setting to speak of
        ("censored", 1),
        ("still", 1),  # 0.0099 nats; the failed run does not count
        ("entropies", 2),  # of the judged ones
        ("left", 2),
        ("right", 1),
    ],
)
def test_counts(name, number):
    assert sweep_counts.counts(SUMMARY)[name] == number


def test_readable_runs_of_a_setting():
    assert [sweep_counts.readable(group) for group in SUMMARY["groups"]] == [6, 5, 0]


def test_numbers_in_words():
    assert sweep_counts.from_to([200]) == "200"
    assert sweep_counts.from_to([100, 150, 200]) == "100 to 200"


def test_entropies_of_densities_do_not_mean_deterministic():
    runs = [{**r, "entropy": r["entropy"] and r["entropy"] - 3.0} for r in SUMMARY["runs"]]
    assert sweep_counts.counts({**SUMMARY, "runs": runs})["still"] == 0
