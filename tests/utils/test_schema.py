"""Each kind takes what it should, at its very bounds, and refuses the next value by name."""

from pathlib import Path

import numpy as np
import pytest
import torch

from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import (
    Flag,
    Instance,
    Listed,
    OneOf,
    Plain,
    Real,
    Several,
    Span,
    Text,
    Whole,
    shown,
)


@pytest.mark.parametrize(
    ("kind", "value"),
    [
        (Whole(1, 3), 3),
        (Real(-1, 2), -1.0),
        (Whole(1), 10**30),
        (Real(0), 1e300),
        (Real(0, 1, is_above=True), 1.0),
        (Real(0, 1, is_above=True), 1e-300),
        (Real(0, 1, is_below=True), 0.0),
        (Flag(), True),
        (OneOf(("a", "b")), "b"),
        (OneOf(("a",), also=("b",)), "b"),
        (Instance(bytes), b"x"),
        (Listed("policy"), ("a", "b")),
        (Text(3), "abc"),
        (Instance(bytes | None), None),
        (Several(Whole(0, 9), 1, 2), (4, 5)),
        (Plain(), {"a": [1, None, {"b": [0.5, True, "c"]}]}),
    ],
)
def test_accepted_values(kind, value):
    assert kind.read(value, "x") == value


@pytest.mark.parametrize(
    ("kind", "value"),
    [
        (Whole(1, 3), 0),
        (Whole(1, 3), 4),
        (Whole(1, 3), 3.0),
        (Whole(1, 3), "2"),
        (Real(-1, 2), 2.1),
        (Real(-1, 2), -1.1),
        (Real(-1, 2), float("nan")),
        (Real(-1, float("1e9")), 10**400),
        (Real(-1, 2), False),
        (Real(0), -1e-9),
        (Real(float("-inf")), "1"),
        (Real(0), float("inf")),
        (Real(0, is_above=True), 0),
        (Real(0, 1, is_above=True, is_below=True), 1),
        (Real(0, 1, is_below=True), 1),
        (Flag(), 1),
        (Flag(), "true"),
        (OneOf(("a", "b")), "c"),
        (OneOf(("a",), also=("b",)), "c"),
        (Instance(bytes), 3),
        (Listed("policy"), []),
        (Listed("policy", most=1), ["a", "b"]),
        (Listed("policy"), 3),
        (Text(3), "abcd"),
        (Text(9), "a\nb"),
        (Text(9), 5),
        (Listed("axis"), 3),
        (Several(Whole(0, 9), 1, 2), []),
        (Several(Whole(0, 9), 1, 2), [1, 2, 3]),
        (Several(Whole(0, 9), 1, 2), [1, 10]),
        (Plain(), []),
        (Plain(), {"a": [float("inf")]}),
        (Plain(), {"a": [object()]}),
        (Plain(), {"a": [torch.zeros(3)]}),
        (Plain(), {"a\nb": 1}),
        (Plain(), {"a": ["a\nb"]}),
    ],
)
def test_refused_values(kind, value):
    with pytest.raises(InputError, match="x") as error:
        kind.read(value, "x")
    assert "\n" not in str(error.value)


def test_endless_lists_are_refused():
    endless = []
    endless.append(endless)
    with pytest.raises(InputError, match=r"^x=\(dict\): it must be plain data"):
        Plain().read({"a": endless}, "x")


def test_numbers_become_floats_and_lists_tuples():
    assert type(Real(0, 9).read(3, "x")) is float
    assert Several(Real(0, 9), 0, 2).read([1, 2], "x") == (1.0, 2.0)


def test_what_is_shown_is_short_and_on_one_line():
    assert shown("a\n" * 1000).count("\n") == 0
    assert len(shown("a" * 10**6)) <= 80
    assert len(shown(10**400)) == 80
    assert shown([1, "a"]) == "[1,'a']" and shown([1] * 9) == "(list)"
    assert shown(None) == "None"


def test_a_span_is_a_value_or_two_in_order():
    assert Span(Real(0.0)).read(3, "x") == 3.0
    assert Span(Real(0.0)).read([1, 2], "x") == (1.0, 2.0)
    assert Span(Several(Real(0.0), 2, 2)).read([3, 2], "x") == (3.0, 2.0)
    assert Span(Several(Real(0.0), 2, 2)).read([[1, 2], [3, 2]], "x") == ((1.0, 2.0), (3.0, 2.0))
    for kind, value in ((Real(0.0), [2, 1]), (Several(Real(0.0), 2, 2), [[1, 2], [3, 1]])):
        with pytest.raises(InputError, match=r"^x=.*: it must have the lower value first"):
            Span(kind).read(value, "x")


def test_messages_name_place_value_and_bounds():
    for kind, value, message in (
        (Whole(0, 9), 10, "x=10: it must be a whole number from 0 to 9"),
        (Several(Real(0, 1), 0, 2), [0.5, 2], r"x\[1\]=2: it must be a number from 0 to 1"),
        (OneOf(("sun", "fog")), "fogg", r"x='fogg': it must be 'sun' or 'fog'; did you mean fog\?"),
        (Text(3), "abcd", "x='abcd': it must be one line of at most 3 printable characters"),
    ):
        with pytest.raises(InputError, match=f"^{message}$"):
            kind.read(value, "x")


def test_values_of_libraries_are_plain():
    read = [Whole(0, 9).read(np.int64(3), "x"), Real(0.0, 1.0).read(np.float32(0.5), "x")]
    assert read == [3, 0.5] and [type(number) for number in read] == [int, float]
    assert Text(20).read(Path("a/b.pt"), "x") == "a/b.pt"
    assert Text(20).read(torch.device("cuda", 1), "x") == "cuda:1"
    for kind, wrong in (
        (Whole(0, 9), np.float64(3.0)),
        (Whole(0, 9), np.int64(10)),
        (Text(20), torch.tensor(1)),
        (Text(20), torch.float32),
    ):
        with pytest.raises(InputError, match=r"^x=.*: it must "):
            kind.read(wrong, "x")
