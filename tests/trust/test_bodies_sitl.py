from drone_rl.trust.bodies import LOOPED, cell, left_out, rows, sitl_cell
from drone_rl.utils.intervals import proportion
from tests.trust.test_bodies_text import BAD, GOOD

FLIGHTS = {"good": {"success": proportion(4, 5)}, "poor": {"left_out": "no rotor turned"}}
NUMBERS = {
    "bodies": ["simple flight"],
    "policies": {"good": {"simple flight": GOOD}, "poor": {"simple flight": BAD}},
}


def test_a_success_rate_is_no_verdict():
    """Of 4 of 5, exactly: 28% to 99%."""
    assert sitl_cell({"success": proportion(4, 5)}) == "no verdict: 4 of 5 (28.4 to 99.5%)"


def test_a_column_for_episodes_with_software_in_the_loop():
    head, good, poor = ["", "simple flight"], ["good", cell(GOOD)], ["poor", cell(BAD)]
    assert rows(NUMBERS) == [head, good, poor]
    assert rows({**NUMBERS, LOOPED: FLIGHTS}) == [
        [*head, "software in the loop"],
        [*good, "no verdict: 4 of 5 (28.4 to 99.5%)"],
        [*poor, "left out"],
    ]


def test_reasons_for_missing_episodes():
    assert left_out({"policies": {}}) == []
    assert left_out({**NUMBERS, LOOPED: FLIGHTS}) == ["poor, software in the loop: no rotor turned"]
