"""The table of the axes of perturbation."""

from drone_rl.trust.axes import AXES
from tools.readme.axes import MEANINGS, list_axes


def test_each_axis_has_a_row_with_its_unit_and_strengths():
    _, _, *rows = list_axes().splitlines()
    assert len(rows) == len(AXES) == len(MEANINGS)
    fog = "| `fog` | fog | visibility, metres | clear air | 100, 60, 40, 25, 15 | m of sight |"
    assert fog in rows
    sun = "elevation above the horizon, degrees | 55.2 | 60, 30, 15, 5, 0 | degrees"
    assert f"| `sun` | light | {sun} |" in rows
