"""Several judgements as a sequence and as a table, made by hand."""

from types import SimpleNamespace

import pytest

from drone_rl.trust.judge import Judgements
from drone_rl.trust.rule import Kind


def judged(name, kind, certain, share):
    success = {"share": share, "lower95": share - 0.05, "upper95": share + 0.05}
    verdict = SimpleNamespace(kind=kind, certain=certain, evidence={"greedy": {"success": success}})
    return SimpleNamespace(name=name, verdict=verdict)


@pytest.fixture
def both():
    return Judgements((judged("a", Kind.GOOD, True, 0.95), judged("<b>", Kind.POOR, False, 0.1)))


def test_it_is_a_sequence(both):
    assert len(both) == 2
    assert both[1].name == "<b>" and [one.name for one in both[:1]] == ["a"]
    assert [one.name for one in both] == ["a", "<b>"]


def test_each_is_a_row_with_its_rate_of_successes(both):
    assert both.rows() == [
        ["policy", "verdict", "certain", "success rate (95% CI)"],
        ["a", "good", "yes", "95.0% (90.0 to 100.0)"],
        ["<b>", "poor", "no", "10.0% (5.0 to 15.0)"],
    ]
    assert [line.split()[0] for line in str(both).splitlines()] == ["policy", "a", "<b>"]


def test_names_are_escaped_in_a_notebook(both):
    assert "&lt;b&gt;" in both._repr_html_() and "<b>" not in both._repr_html_()
