"""The page of settings shows the docstrings of the settings classes."""

from typing import Annotated, ClassVar

import pytest

from drone_rl.cli.hydra.composition import GROUPS, PARTS, SEVERAL
from drone_rl.cli.main import COMMANDS, find_command
from drone_rl.config import DynamicsSettings
from drone_rl.utils.schema import OneOf, Real, Several, Whole
from drone_rl.utils.settings import Settings, meanings
from tools.readme.settings import make_table


class Sea(Settings):
    """Water.

    Salty.
    """

    color: ClassVar[str] = "blue"
    """No setting."""
    depth: Annotated[float, Real(0.0, 11_000.0, is_above=True, unit="m")] = 100.0
    """How deep, |z| below
    the surface."""
    tides: Annotated[tuple[int, ...], Several(Whole(0, unit="hours"), 2, 2)] | None = None
    """When it is high; null for never."""
    wind: Annotated[str, OneOf(("none", "storm"))] = "none"
    """How it blows."""
    is_salty: bool = True
    """Whether."""


def test_a_row_has_allowed_values_unit_default_and_meaning():
    assert make_table(Sea, "sea.").splitlines()[2:] == [
        "| `sea.depth` | a number above 0 up to 11000 | m | `100.0` | "
        "How deep, &#124;z&#124; below the surface. |",
        "| `sea.tides` | 2 values, each a whole number of 0 or more; or null | hours | `null` | "
        "When it is high; null for never. |",
        "| `sea.wind` | `none` or `storm` |  | `none` | How it blows. |",
        "| `sea.is_salty` | true or false |  | `true` | Whether. |",
    ]


def commands():
    return [find_command(command) for command in COMMANDS]


@pytest.mark.parametrize(
    "cls",
    [
        *(cls for cls, _ in GROUPS.values()),
        *commands(),
        *(v for part in {**PARTS, **SEVERAL}.values() for v in part.registry.values()),
    ],
    ids=lambda cls: f"{cls.__module__}.{cls.__name__}",
)
def test_every_setting_has_a_meaning_and_seconds_a_suffix(cls):
    assert all(meanings(cls).get(name) for name in cls.model_fields)
    for line in make_table(cls).splitlines()[2:]:
        name, may_be, unit = [cell.strip("| `") for cell in line.split(" | ")][:3]
        assert may_be
        is_physics = cls is DynamicsSettings  # SI throughout
        assert (unit == "s") == name.endswith("_s") or is_physics, name
