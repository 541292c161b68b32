"""Settings are checked wherever they come from, and a message begins with their name."""

import math
from pathlib import Path
from typing import Annotated, Any

import pytest

import drone_rl
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Real, Several, Whole
from drone_rl.utils.settings import (
    Settings,
    hints_of,
    inner_types,
    meanings,
    prefixed_errors,
    unit_of,
)


class Inner(Settings):
    x: Annotated[int, Whole(0, 9)] = 1


class Outer(Settings):
    count: Annotated[int, Whole(1, 3)] = 2
    size: Annotated[float, Real(0.0, 1.0)] | None = None
    widths: Annotated[tuple[int, ...], Several(Whole(1, 9), 0, 2)] = (4,)
    is_on: bool = False
    name: str = "a"
    inner: Inner = Inner()

    def check(self):
        if self.is_on and self.size is None:
            raise InputError("size=None needs a value; give one")


def test_settings_are_frozen():
    made: Any = Inner(x=3)
    with pytest.raises(ValueError, match="frozen"):
        made.x = 4
    assert made == Inner(x=3) and hash(made) == hash(Inner(x=3))


def test_equal_settings_have_equal_hashes():
    class Named(Settings):
        parts: dict[str, Inner] = {}

    one, other = (
        Named(parts={"a": Inner(x=2), "b": Inner()}),
        Named(parts={"b": Inner(), "a": Inner(x=2)}),
    )
    assert one == other and hash(one) == hash(other)
    assert hash(one) != hash(Named(parts={"a": Inner()}))


def test_as_base_leaves_out_further_fields():
    class More(Outer):
        extra: str = "z"

    assert More(count=3, extra="y").as_base(Outer) == Outer(count=3)


def test_values_take_their_types_and_are_plain_data():
    made = Outer(size=1, widths=[1, 2], name=Path("a"))
    assert (made.size, type(made.size), made.widths) == (1.0, float, (1, 2))
    assert made.values() == {
        **{"count": 2, "size": 1.0, "widths": [1, 2]},
        **{"is_on": False, "name": "a", "inner": {"x": 1}},
    }
    assert Outer.read(made.values()) == made
    assert Outer.read({}) == Outer()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"count": 0}, "count=0: it must be a whole number from 1 to 3"),
        ({"size": "x"}, "size='x': it must be a number from 0"),
        ({"inner": {"x": 10}}, r"inner\.x=10: it must be a whole"),
        ({"is_on": True}, "size=None needs a value"),
        ({"cout": 1}, r"cout is unknown; valid names: count, size.*; did you mean count\?"),
    ],
)
def test_errors_begin_with_the_name(change, message):
    with pytest.raises(InputError, match=f"^{message}"):
        Outer().replace(**change)


def test_errors_have_a_prefix():
    failing = pytest.raises(InputError, match=r"^a\.b\.x=10")
    with failing, prefixed_errors("a"), prefixed_errors("b"):
        Inner(x=10)


def test_numbers_without_a_kind_are_strict_and_finite():
    class Priced(Settings):
        cost: float = 0.5
        count: int | None = None

    assert Priced(cost=-3).cost == -3.0
    for wrong in ({"cost": "3"}, {"cost": True}, {"cost": math.nan}, {"count": 3.0}):
        with pytest.raises(InputError, match=r"^co\w+="):
            Priced(**wrong)


def test_descriptions_units_and_kinds_are_those_of_the_class():
    class Boat(Settings):
        length: Annotated[tuple[float, ...], Several(Real(0.0, unit="m"), 1, 2)] | None = None
        """Length over all,
        in metres."""

    assert meanings(Boat) == {"length": "Length over all, in metres."}
    assert inner_types(hints_of(Boat)["length"]) == (Several(Real(0.0, unit="m"), 1, 2),)
    assert unit_of(hints_of(Boat)["length"]) == "m"


def test_a_task_may_be_given_by_its_name():
    assert drone_rl.TrainSettings(task="pillars").task == drone_rl.PillarsSettings()  # pyright: ignore[reportArgumentType]
    with pytest.raises(InputError, match=r"^task='pillar': .*plugins=\[MODULE\].*pillars\?"):
        drone_rl.TrainSettings(task="pillar")  # pyright: ignore[reportArgumentType]
