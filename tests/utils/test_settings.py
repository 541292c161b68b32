"""Settings are checked wherever they come from, and a message begins with their name."""

import dataclasses
from typing import Annotated, Any

import pytest

import drone_rl
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Real, Several, Whole
from drone_rl.utils.settings import (
    Settings,
    kinds_of,
    plain,
    prefixed_errors,
    snake_case,
    types_of,
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
    with pytest.raises(dataclasses.FrozenInstanceError):
        made.x = 4
    assert made == Inner(x=3) and hash(made) == hash(Inner(x=3))


def test_as_base_leaves_out_further_fields():
    class More(Outer):
        extra: str = "z"

    assert More(count=3, extra="y").as_base(Outer) == Outer(count=3)


def test_values_take_their_types():
    made = Outer(size=1, widths=[1, 2])
    assert (made.size, type(made.size), made.widths) == (1.0, float, (1, 2))
    assert made.values() == {
        **{"count": 2, "size": 1.0, "widths": [1, 2]},
        **{"is_on": False, "name": "a", "inner": {"x": 1}},
    }


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"count": 0}, "count=0 is out of range"),
        ({"size": "x"}, "size='x'"),
        ({"widths": [1, 2, 3]}, r"widths=\[1,2,3\] does not fit"),
        ({"is_on": 1}, "is_on=1 is neither true nor false"),
        ({"name": 5}, "name=5 is no text"),
        ({"inner": 3}, "inner=3 is no Inner"),
        ({"is_on": True}, "size=None needs a value"),
        ({"unheard": 1}, "unheard is unknown; valid names: count, size"),
    ],
)
def test_errors_begin_with_the_name(change, message):
    with pytest.raises(InputError, match=f"^{message}"):
        Outer().replace(**change)


def test_files_must_have_every_field():
    whole = {"x": 3}
    assert Inner.read(whole, "inner") == Inner(x=3)
    for data in ({}, {"x": 3, "y": 1}, {"x": 10}, [1]):
        with pytest.raises(InputError, match=r"^inner"):
            Inner.read(data, "inner")


def test_errors_have_a_prefix():
    failing = pytest.raises(InputError, match=r"^a\.b\.x=10 ")
    with failing, prefixed_errors("a"), prefixed_errors("b"):
        Inner(x=10)


def test_kinds_and_types_of_each_field():
    assert kinds_of(Inner) == {"x": Whole(0, 9)}
    assert types_of(Outer) == {
        **{"count": int, "size": float | None, "widths": tuple[int, ...]},
        **{"is_on": bool, "name": str, "inner": Inner},
    }


def test_floats_are_finite():
    class Priced(Settings):
        cost: float = 0.5

    assert Priced(cost=-3).cost == -3.0
    with pytest.raises(InputError, match="cost=nan is out of range; give a finite number"):
        Priced(cost=float("nan"))


@pytest.mark.parametrize(
    "hint", [int | str, list[int], Annotated[int, 3], Annotated[int, Whole], dict[str, int]]
)
def test_types_without_a_kind_are_refused(hint):
    odd = type("Odd", (Settings,), {"__annotations__": {"x": hint}, "x": 1})
    with pytest.raises(InputError, match=r"^x is of type .*; annotate it with a kind of"):
        odd()


def test_snake_case_and_plain_values():
    assert [snake_case(c) for c in (Inner, Outer)] == ["inner", "outer"]
    assert snake_case(type("SmallCnn", (), {})) == "small_cnn"
    assert plain({"a": (1, (2,)), "b": Inner()}) == {"a": [1, [2]], "b": {"x": 1}}


def test_unknown_names_are_refused():
    with pytest.raises(InputError, match=r"^num_cube is unknown; .*; did you mean num_cubes\?$"):
        drone_rl.TaskSettings(num_cube=2)  # pyright: ignore[reportCallIssue]
    with pytest.raises(TypeError, match="positional"):
        drone_rl.TaskSettings(2)  # pyright: ignore[reportCallIssue]


def test_a_task_may_be_given_by_its_name():
    assert drone_rl.TrainSettings(task="pillars").task == drone_rl.PillarsSettings()  # pyright: ignore[reportArgumentType]
    with pytest.raises(
        InputError, match=r"^task='pillar' is unknown.*plugins=\[MODULE\].*pillars\?"
    ):
        drone_rl.TrainSettings(task="pillar")  # pyright: ignore[reportArgumentType]


def test_attributes_without_a_type_are_refused():
    with pytest.raises(InputError, match=r"Half\.cost has no type.*write cost: float = 0\.005"):

        class Half(Inner):
            cost = 0.005

    with pytest.raises(InputError, match=r"Other\.x has no type.*write x: int = 3"):

        class Other(Inner):  # the base's default would stay
            x = 3
