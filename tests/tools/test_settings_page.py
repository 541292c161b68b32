"""The page of settings shows the docstrings of the settings classes."""

from typing import Annotated, ClassVar

import pytest

from drone_rl.cli.hydra.composition import GROUPS, PARTS, SEVERAL
from drone_rl.cli.main import COMMANDS, find_command
from drone_rl.config import DynamicsSettings
from drone_rl.utils.schema import OneOf, Real, Several, Whole
from drone_rl.utils.settings import Settings, meanings
from tools.readme.settings import list_commands, make_table


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


class Pond(Sea):
    """Less water."""

    depth: Annotated[float, Real(0.0, 3.0, unit="m")] = 1.0
    """How shallow."""


def test_a_row_has_allowed_values_unit_default_and_meaning():
    assert make_table(Sea, "sea.").splitlines()[2:] == [
        "| `sea.depth` | a number above 0 up to 11000 | m | `100.0` | "
        "How deep, &#124;z&#124; below the surface. |",
        "| `sea.tides` | 2 values, each a whole number of 0 or more; or null | hours | `null` | "
        "When it is high; null for never. |",
        "| `sea.wind` | `none` or `storm` |  | `none` | How it blows. |",
        "| `sea.is_salty` | true or false |  | `true` | Whether. |",
    ]


def test_a_subclass_overrides_meanings():
    first, second, *_ = make_table(Pond).splitlines()[2:]
    assert first == "| `depth` | a number from 0 to 3 | m | `1.0` | How shallow. |"
    assert second.startswith("| `tides` |")


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


def test_commands_link_to_their_groups():
    train = list_commands().partition("### drone-rl train")[2].partition("### ")[0]
    assert "| `camera` | [camera](#camera) |  |  |" in train
    assert (
        "| `transforms` | [transforms](#transforms) |  | `gray`, `resize`, `standardize`" in train
    )
    assert "changes to the policy's [task](#task)" in list_commands()
