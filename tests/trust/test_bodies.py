"""A policy in several bodies from Python, and what each body changes."""

import pytest
from matplotlib.colors import to_hex

import drone_rl
from drone_rl.config import DynamicsSettings
from drone_rl.trust.bodies import (
    Bodies,
    changes_of,
)
from drone_rl.utils import palette
from drone_rl.utils.errors import InputError
from drone_rl.utils.intervals import proportion
from drone_rl.utils.progress import silent
from tests.evidence import VERDICT, changed

TWO = ["computer vision", "wind 8 m/s"]
STILL = {"wind": [0.0, 0.0, 0.0], "gusts": 0.0}
FLYING = {"mode": "simple_flight", "camera_mount": "gimbal"}


@pytest.fixture(scope="module")
def done():
    near = drone_rl.load_policy("good").in_task(num_cubes=1)
    return drone_rl.bodies([near], episodes=4, bodies=TWO, progress=silent)


@pytest.mark.parametrize(
    ("body", "changes"),
    [
        ("computer vision", {"mode": "computer_vision", **STILL}),
        ("wind 8 m/s", {**FLYING, "wind": [0.0, 8.0, 0.0], "gusts": 2.0}),
        ("motors twice as slow", {**FLYING, **STILL, "rotor_time_constant": 0.02}),
        ("camera on the body", {**FLYING, **STILL, "camera_mount": "body"}),
    ],
)
def test_changes_of_named_dynamics(body, changes):
    assert changes_of(body, DynamicsSettings(rotor_time_constant=0.01)) == changes


def test_a_verdict_for_each_dynamics(done):
    flown = done.policies["good"]
    assert [*done.bodies] == [*flown] == TWO
    assert all(verdict.greedy.episodes == 4 for verdict in flown.values())
    assert flown["computer vision"].greedy.success.share == 1.0


def test_text_and_files(done, tmp_path):
    assert str(done).splitlines()[0].split() == ["computer", "vision", "wind", "8", "m/s"]
    assert "<td>good</td>" in done._repr_html_() and "<img" in done._repr_html_()
    done.save(tmp_path)
    kept = Bodies.read_json(tmp_path / "bodies.json")
    assert kept.rows() == done.rows() and kept.versions
    assert (tmp_path / "bodies.png").read_bytes().startswith(b"\x89PNG")
    assert "<svg" in (tmp_path / "bodies.svg").read_text()


@pytest.mark.parametrize(
    ("policies", "told", "message"),
    [
        ([], {}, r"policies=\[\] is empty"),
        (["good", "good"], {}, "two policies are called good"),
    ],
)
def test_mistakes(policies, told, message):
    with pytest.raises(InputError, match=message):
        drone_rl.bodies(policies, progress=silent, **told)


def share(value, lower, upper):
    of = {"successes": round(400 * value), "trials": 400}
    return {"share": value, "lower95": lower, "upper95": upper, **of}


GOOD = changed(
    VERDICT,
    {
        "kind": "good",
        "certain": True,
        "greedy.success": share(0.975, 0.954, 0.988),
        "failures.largest": None,
    },
)
BAD = changed(
    VERDICT,
    {
        "kind": "poor",
        "certain": False,
        "greedy.success": share(0.1, 0.07, 0.14),
        "failures.largest": VERDICT["failures"]["rows"][1],
    },
)
TABLE = Bodies(
    bodies=("computer vision", "wind 8 m/s"),
    policies={"one": {"computer vision": GOOD, "wind 8 m/s": BAD}},
)


def test_table_has_a_row_per_policy():
    assert TABLE.rows() == [
        ["", "computer vision", "wind 8 m/s"],
        ["one", "good 97.5% (95.4% to 98.8%)", "poor? 10.0% (7.0% to 14.0%)"],
    ]


def test_chart_cells_have_the_color_of_their_verdict():
    (table,) = TABLE.figure().axes[0].tables
    cells = [table[1, x] for x in (0, 1)]
    assert [cell.get_hatch() for cell in cells] == [None, "//"]  # the second is not certain
    assert "97.5%" in cells[0].get_text().get_text().replace("\n", " ")
    green, red = (to_hex(cell.get_facecolor()) for cell in cells)
    assert (green, red) == (*(palette.css(palette.light(c)) for c in (palette.GOOD, palette.BAD)),)


def test_column_of_episodes_with_software_in_the_loop():
    flights = VERDICT["greedy"] | {"success": proportion(4, 5)}
    table = TABLE.replace(in_the_loop={"one": flights})
    assert table.rows()[1][-1] == "no verdict: 4 of 5 (28.4% to 99.5%)"
    missing = TABLE.replace(in_the_loop={"one": {"left_out": "no rotor turned"}})
    assert missing.rows()[1][-1] == "left out"
    assert "one, software in the loop: no rotor turned" in missing.notes()
