"""Each kind takes what it should, at its very bounds, and refuses the next value by name."""

from pathlib import Path

import numpy as np
import pytest
import torch

from drone_rl.config.networks import Network
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import (
    Flag,
    Instance,
    Listed,
    Maybe,
    OneOf,
    Plain,
    Real,
    Record,
    Several,
    Span,
    Text,
    Whole,
    shown,
)


@pytest.mark.parametrize(
    ("kind", "value"),
    [
        (Whole(1, 3), 1),
        (Whole(1, 3), 3),
        (Real(-1, 2), 2.0),
        (Real(-1, 2), -1.0),
        (Whole(1), 10**30),
        (Real(0), 1e300),
        (Real(0, 1, is_above=True), 1.0),
        (Real(0, 1, is_above=True), 1e-300),
        (Real(0, 1, is_below=True), 0.0),
        (Flag(), True),
        (Flag(), False),
        (OneOf(("a", "b")), "b"),
        (OneOf(("a",), also=("b",)), "b"),
        (Instance(bytes), b"x"),
        (Listed("policy"), ("a", "b")),
        (Text(3), "abc"),
        (Maybe(Whole(1, 3)), None),
        (Maybe(Whole(1, 3)), 2),
        (Several(Whole(0, 9), 1, 2), (4, 5)),
        (Record({"a": Whole(0, 1)}), {"a": 1}),
        (Record({"a": Whole(0, 1)}, frozenset({"a"})), {}),
        (Plain(most=3, deepest=2), {"a": [1, None]}),
    ],
)
def test_what_is_taken(kind, value):
    assert kind.read(value, "x") == value


@pytest.mark.parametrize(
    ("kind", "value", "message"),
    [
        (Whole(1, 3), 0, "x=0 is out of range"),
        (Whole(1, 3), 4, "from 1 to 3"),
        (Whole(0, 3), True, "x=True"),
        (Whole(1, 3), 3.0, r"x=3\.0"),
        (Whole(1, 3), "2", "x='2'"),
        (Real(-1, 2), 2.1, r"x=2\.1"),
        (Real(-1, 2), -1.1, r"x=-1\.1"),
        (Real(-1, 2), float("nan"), "x=nan"),
        (Real(-1, float("1e9")), 10**400, "x=1000"),
        (Real(-1, 2), False, "x=False"),
        (Whole(1), 0, "give a whole number of 1 or more"),
        (Real(0), -1e-9, "give a number of 0 or more"),
        (Real(float("-inf")), "1", "x='1' is a text; give a finite number$"),
        (Real(0), float("inf"), "x=inf"),
        (Real(0), 10**400, "x=1000"),
        (Real(0, is_above=True), 0, "give a number above 0$"),
        (Real(0, 1, is_above=True), 0.0, "above 0 up to 1"),
        (Real(0, 1, is_above=True, is_below=True), 1, "above 0 and below 1"),
        (Real(0, 1, is_below=True), 1, "from 0 to below 1"),
        (Flag(), 1, "x=1 is neither true nor false"),
        (Flag(), "true", "x='true'"),
        (OneOf(("a", "b")), "c", "x='c' is unknown; give a, b"),
        (OneOf(("a",), also=("b",)), "c", "x='c' is unknown; give a$"),
        (OneOf(("1", "b")), 1, "x=1 is unknown"),
        (Instance(bytes), "x", "x='x' is no bytes; give a bytes$"),
        (Listed("policy"), [], "must name a policy"),
        (Listed("policy"), ["a", "a"], "each once"),
        (Listed("policy", most=1), ["a", "b"], "or a list"),
        (Listed("policy"), 3, "x=3 must name"),
        (Listed("policy"), [3], "x=3 is no text"),
        (Text(3), "abcd", "at most 3"),
        (Text(9), "a\nb", "printable"),
        (Text(9), "a\x1b[0m", "printable"),
        (Text(9), 5, "x=5"),
        (Maybe(Whole(1, 3)), 4, "x=4"),
        (Maybe(Whole(1, 3)), "None", r"^x=None is a text; write null \(None in Python\)$"),
        (Maybe(Whole(1, 3)), "no", "^x='no' is a text"),
        (Listed("axis"), 3, "must name an axis or a list of them, each once"),
        (Several(Whole(0, 9), 1, 2), [], "1 to 2 values"),
        (Several(Whole(0, 9), 1, 2), [1, 2, 3], "1 to 2 values"),
        (Several(Whole(0, 9), 1, 2), [1, 10], r"x\[1\]=10"),
        (Several(Whole(0, 9), 1, 2), "12", "x='12'"),
        (Record({"a": Whole(0, 1)}), {"a": 1, "b": 2}, "x.'b' is unknown"),
        (Record({"a": Whole(0, 1)}), {}, r"x\.a is missing"),
        (Record({"a": Whole(0, 1)}), {"a": 2}, r"x\.a=2"),
        (Record({}), [], "x=\\(list\\) must be a mapping"),
        (Record({}), {1: 2}, "must be a mapping"),
        (Plain(most=3), [1, 2, 3, 4], "more than 3"),
        (Plain(deepest=2), [[[1]]], "nested more than 2"),
        (Plain(), [float("inf")], "finite"),
        (Plain(), [object()], "type object"),
        (Plain(), {"a\nb": 1}, "a name in x"),
        (Plain(), ["a\nb"], "a text in x"),
    ],
)
def test_what_is_refused(kind, value, message):
    with pytest.raises(InputError, match=message) as error:
        kind.read(value, "x")
    assert "\n" not in str(error.value)


def test_a_few_lists_that_hold_each_other_a_thousand_times_cost_nothing():
    bomb = [0] * 1000
    for _ in range(8):
        bomb = [bomb] * 1000
    with pytest.raises(InputError, match="more than 20000"):
        Plain().read(bomb, "x")
    endless = []
    endless.append(endless)
    with pytest.raises(InputError, match="nested"):
        Plain().read(endless, "x")


def test_one_text_is_a_list_of_it():
    assert Listed("policy").read("good", "x") == ("good",)


def test_numbers_become_floats_and_lists_tuples():
    assert type(Real(0, 9).read(3, "x")) is float
    assert Several(Real(0, 9), 0, 2).read([1, 2], "x") == (1.0, 2.0)


def test_what_is_shown_is_short_and_on_one_line():
    assert shown("a\n" * 1000).count("\n") == 0
    assert len(shown("a" * 10**6)) <= 80
    assert len(shown(10**400)) == 80
    assert shown([1]) == "(list)"
    assert shown(None) == "None"


def test_a_span_is_a_value_or_two_in_order():
    assert Span(Real(0.0)).read(3, "x") == 3.0
    assert Span(Real(0.0)).read([1, 2], "x") == (1.0, 2.0)
    assert Span(Several(Real(0.0), 2, 2)).read([3, 2], "x") == (3.0, 2.0)
    assert Span(Several(Real(0.0), 2, 2)).read([[1, 2], [3, 2]], "x") == ((1.0, 2.0), (3.0, 2.0))
    for kind, value in ((Real(0.0), [2, 1]), (Several(Real(0.0), 2, 2), [[1, 2], [3, 1]])):
        with pytest.raises(InputError, match="x goes from 2 to 1, which is less"):
            Span(kind).read(value, "x")


@pytest.mark.parametrize("value", [[0, [1, 2]], [[1, 2]], [0, 0, [1, 2]], [0, [1, 2]]])
def test_ranges_of_single_values_are_answered_with_the_form_of_a_range(value):
    words = (
        r"^x has ranges of single values; give numbers, .* as \[\[LOW,\.\.\.\],\[HIGH,\.\.\.\]\]$"
    )
    with pytest.raises(InputError, match=words):
        Span(Several(Real(0.0), 2, 2)).read(value, "x")


def test_texts_are_no_numbers():
    for kind in (Whole(1), Real(0.0)):
        with pytest.raises(InputError, match=r"^n='1' is a text; give a (whole )?number"):
            kind.read("1", "n")


def test_lists_of_a_wrong_length_are_shown():
    with pytest.raises(InputError, match=r"^wind=\[5\] does not fit; give a list of 3 values"):
        Several(Real(0.0), 3, 3).read([5], "wind")
    with pytest.raises(InputError, match=r"^x=\(list\) does not fit; give a list of 1 to 3 values"):
        Several(Real(0.0), 1, 3).read([0] * 9, "x")


def test_missing_settings_and_other_objects_are_named():
    with pytest.raises(InputError, match=r"^task is missing; give task=NAME"):
        Instance(Whole).read("???", "task")
    with pytest.raises(
        InputError, match=r"^x=3 is no Whole; give drone_rl.utils.schema.Whole\(\.\.\.\)"
    ):
        Instance(Whole).read(3, "x")
    with pytest.raises(InputError, match=r"^network=\(the class dict\) is no Network; give "):
        Instance(Network).read(dict, "network")
    with pytest.raises(InputError, match=r"networks\.SmallCnn\(\.\.\.\) or a registered name$"):
        Instance(Network).read(3, "network")


def test_numbers_of_numpy_are_numbers():
    found = Whole(0, 9).read(np.int64(3), "x"), Real(0.0, 1.0).read(np.float32(0.5), "x")
    assert found == (3, 0.5) and [type(f) for f in found] == [int, float]
    with pytest.raises(InputError, match="x=True is not a whole number"):
        Whole(0, 9).read(True, "x")
    with pytest.raises(InputError, match=r"x=3\.0 is not a whole number"):
        Whole(0, 9).read(np.float64(3.0), "x")
    with pytest.raises(InputError, match="x=10 is out of range"):
        Whole(0, 9).read(np.int64(10), "x")


def test_truth_values_of_numpy_are_truth_values():
    assert Flag().read(np.bool_(True), "x") is True
    with pytest.raises(InputError, match="x=1 is neither true nor false"):
        Flag().read(np.int64(1), "x")


def test_paths_and_devices_are_their_text():
    assert Text(20).read(Path("a/b.pt"), "x") == "a/b.pt"
    assert Text(20).read(torch.device("cuda", 1), "x") == "cuda:1"
    for wrong in (torch.tensor(1), torch.float32):
        with pytest.raises(InputError, match=r"^x=.* is no text"):
            Text(20).read(wrong, "x")
