"""The page of settings shows the docstrings of the settings classes."""

from typing import Annotated, ClassVar

import pytest

from drone_rl.cli.hydra.composition import GROUPS, PARTS, SEVERAL
from drone_rl.cli.main import COMMANDS, find_command
from drone_rl.config import DynamicsSettings
from drone_rl.config.networks import SmallCnn
from drone_rl.config.transforms import Crop
from drone_rl.utils.schema import OneOf, Real, Several, Whole
from drone_rl.utils.settings import Settings, kinds_of
from tools.readme.__main__ import ROOT
from tools.readme.settings import (
    first_comment,
    list_choices,
    list_commands,
    list_parts,
    list_presets,
    make_table,
    meanings,
)


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
        *GROUPS.values(),
        *commands(),
        *(v for part in {**PARTS, **SEVERAL}.values() for v in part.variants()),
    ],
    ids=lambda cls: f"{cls.__module__}.{cls.__name__}",
)
def test_every_setting_has_a_meaning_and_seconds_a_suffix(cls):
    assert all(meanings(cls).get(name) for name in kinds_of(cls))
    for line in make_table(cls).splitlines()[2:]:
        name, may_be, unit = [cell.strip("| `") for cell in line.split(" | ")][:3]
        assert may_be
        is_physics = cls is DynamicsSettings  # SI throughout
        assert (unit == "s") == name.endswith("_s") or is_physics, name


def test_variants_are_listed_below_their_parts():
    text = list_parts()
    network = text.partition("### network")[2].partition("### ")[0]
    assert "**`small_cnn`** Network for small images" in network
    assert make_table(SmallCnn, "network.") in network
    assert make_table(Crop, "transforms.crop.") in text  # transforms can be repeated


def test_commands_link_to_their_groups():
    train = list_commands().partition("### drone-rl train")[2].partition("### ")[0]
    assert "| `camera` | [camera](#camera) |  |  |" in train
    assert (
        "| `transforms` | [transforms](#transforms) |  | `gray`, `resize`, `standardize`" in train
    )
    assert "changes to the policy's [task](#task)" in list_commands()


def test_choices_are_the_files_of_a_group(tmp_path):
    for path in (
        "train.yaml",
        "task/b.yaml",
        "task/a.yaml",
        "hydra/x.yaml",
        "hydra/sweeper/c.yaml",
    ):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).touch()
    assert list_choices(tmp_path).splitlines()[2:] == [
        *("| `hydra/sweeper` | `c` |", "| `task` | `a`, `b` |")
    ]
    assert "| `camera` | `frame`, `large`, `medium`, `small`, `tiny` |" in list_choices(
        ROOT / "conf"
    )


def test_presets_are_described_by_their_first_comment(tmp_path):
    for group in ("experiment", "sweep"):
        (tmp_path / group).mkdir()
    file = tmp_path / "experiment" / "deep.yaml"
    file.write_text(
        "# @package _global_\n# drone-rl train experiment=deep: far\n# down.\nx: 1\n# y\n"
    )
    assert first_comment(file) == "drone-rl train experiment=deep: far down."
    assert list_presets(tmp_path).splitlines()[2:] == [
        "| `drone-rl train experiment=deep` | far down. |"
    ]
    assert len(list_presets(ROOT / "conf").splitlines()) == 2 + sum(
        len(list((ROOT / "conf" / group).glob("*.yaml"))) for group in ("experiment", "sweep")
    )
