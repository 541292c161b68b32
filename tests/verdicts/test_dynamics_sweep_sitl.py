from drone_rl.utils.intervals import proportion
from drone_rl.verdicts.dynamics_sweep import LOOPED, looped, reasons, with_loops

TABLE = [["", "simple flight"], ["good", "good 99.0%"], ["poor", "poor 2.0%"]]
NUMBERS = {
    "policies": {"good": {}, "poor": {}},
    LOOPED: {"good": {"success": proportion(4, 5)}, "poor": {"left_out": "no rotor turned"}},
}


def test_a_share_is_no_verdict():
    """Of 4 of 5, exactly: 28% to 99%."""
    assert looped({"success": proportion(4, 5)}) == "no verdict: 4 of 5 (28 to 99)"


def test_a_column_where_there_were_flights():
    assert with_loops(TABLE, {"policies": {}}) is TABLE
    assert with_loops(TABLE, NUMBERS) == [
        ["", "simple flight", "software in the loop"],
        ["good", "good 99.0%", "no verdict: 4 of 5 (28 to 99)"],
        ["poor", "poor 2.0%", "left out"],
    ]


def test_reasons_are_told():
    assert reasons({"policies": {}}) == []
    assert reasons(NUMBERS) == ["poor, software in the loop: no rotor turned"]
