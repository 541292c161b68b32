import pytest

from drone_rl.explanations.report.behavior import say_advice, say_scope
from tests.evidence import EXPLANATION, changed


@pytest.mark.parametrize(
    ("verdict", "name", "part"),
    [
        ({"kind": "good", "certain": True, "exit_code": 0}, "use", "in no others"),
        ({"kind": "poor", "certain": True, "exit_code": 10}, "refuse", "exit status 10"),
        ({"kind": "good", "certain": False, "enough": 1600}, "more", "(episodes=1600)"),
        ({"kind": "poor", "certain": False, "enough": None}, "more", "may stay open"),
    ],
)
def test_one_thing_to_do(verdict, name, part):
    evidence = changed(EXPLANATION, {f"verdict.{k}": v for k, v in verdict.items()})
    found = say_advice(evidence)
    assert list(found) == [f"advice.{name}"]
    assert part in found[f"advice.{name}"]


def test_nothing_reads_as_if_other_looks_had_been_tested():
    assert (
        "nothing here tests other colors, light or sizes"
        in say_scope(EXPLANATION)["scope.one_look"]
    )
