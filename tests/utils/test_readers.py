"""YAML is data, and no more of it than was asked for."""

import pytest

from drone_rl.utils.errors import InputError
from drone_rl.utils.readers import parse_yaml, read_yaml, with_current_names


def test_plain_data_comes_back(tmp_path):
    (tmp_path / "a.yaml").write_text("fog: {low: 40, high: null, unit: m of sight}\nsun: [1, -2.5]")
    expected = {"fog": {"low": 40, "high": None, "unit": "m of sight"}, "sun": [1, -2.5]}
    assert read_yaml(tmp_path / "a.yaml") == expected


def test_a_merge_sign_is_a_name_like_any_other():
    assert parse_yaml('"<<": {a: 1}\nb: 2', "x") == {"<<": {"a": 1}, "b": 2}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: &a 1", "anchors and aliases"),
        ("a: &a [1]\nb: *a", "anchors and aliases"),
        ("!!python/object/apply:os.system [x]", "tags are not accepted"),
        ('!!int ""', "tags are not accepted"),
        ("[" * 17 + "]" * 17, "nested more than 16"),
        ("[" + "1," * 2001 + "]", "more than 2000 values"),
        ("2001-99-99", "month must be"),
        ("a: \x00", "not allowed"),
    ],
)
def test_what_is_refused_in_one_line(text, message):
    with pytest.raises(InputError, match=rf"x is damaged: no plain YAML .*{message}") as error:
        parse_yaml(text, "x")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "b: 1\na: [1",
            "line 2 of x is no YAML .while parsing a flow sequence: expected .*; correct",
        ),
        ("b: 0\na: 1\nc: 2\na: 2", r"line 4 of x is no YAML \(a occurs twice\); correct it"),
        ("? [a]\n: 1", "line 1 of x is no YAML .*unhashable key.; correct it"),
        ("--- a\n--- b", "line 2 of x is no YAML .*single document"),
        ("a:\n\tb: 1", "line 2 of x is no YAML .*; indent with spaces, not tabs"),
    ],
)
def test_a_line_that_is_no_yaml_is_named(text, message):
    with pytest.raises(InputError, match=message) as error:
        parse_yaml(text, "x")
    assert "\n" not in str(error.value)


def test_figures_of_version_0_1_get_their_current_names():
    older = {"frames": 5, "running_cubes": 2.5, "train/cubes": 1, "train/running_cubes": 2}
    present = {"frames": 5, "running_reward": 2.5, "train/reward": 1, "train/running_reward": 2}
    assert list(with_current_names(older).items()) == list(present.items())
    assert with_current_names(present) == present


def test_values_are_counted_one_by_one(monkeypatch):
    monkeypatch.setattr("drone_rl.utils.readers.YAML_VALUES", 4)
    assert parse_yaml("[1, 2, 3]", "x") == [1, 2, 3]  # and the list itself
    with pytest.raises(InputError, match="more than 4 values"):
        parse_yaml("[1, 2, 3, 4]", "x")
