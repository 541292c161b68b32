import json

import pytest

from drone_rl.trust.coverage import read_requirements
from drone_rl.trust.shifts import ranges_of
from drone_rl.utils.errors import InputError
from tests.evidence import SHIFTS, changed


@pytest.fixture
def read(tmp_path):
    def build(text, name="needs.yaml"):
        (tmp_path / name).write_text(text)
        return read_requirements(tmp_path / name)

    return build


def test_yaml_and_json_say_the_same(read):
    needs = {"fog": {"low": 60.0, "high": None}, "sun": {"low": 5.0, "high": 50.0}}
    text = "fog: {low: 60, unit: m of sight}\nsun: {low: 5, high: 50, unit: degrees}\n"
    assert read(text) == needs
    data = {"fog": {"low": 60, "unit": "m of sight"}}
    data["sun"] = {"low": 5, "high": 50, "unit": "degrees"}
    assert read(json.dumps(data), "needs.json") == needs


def test_what_shifts_leaves_can_be_needed(read):
    ranges = ranges_of(SHIFTS)
    assert ranges["sun"] == {"low": 21.07, "high": 60.0, "unit": "degrees"}
    read(json.dumps(ranges), "domain.json")
    bad = {"domain.ranges.sun.positions": None, "axes.blur.levels.1.modes.constant.unchanged": True}
    assert [*ranges_of(changed(SHIFTS, bad))] == ["brightness"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty; the file was damaged"),
        ("{}", "is empty; give axes"),
        ("[1, 2]", "must be a mapping"),
        ("fog: [", "line 1 of .* is no YAML .*; correct it"),
        ("fog:\n\tlow: 1", "line 2 of .* is no YAML .*; indent with spaces, not tabs"),
        (
            "fog: {low: 1}\nfog: {low: 2}",
            r"line 2 of .* is no YAML \(fog occurs twice\); correct it",
        ),
        ("a: !!python/object/apply:os.getcwd []", "no plain YAML"),
        ("wind: {low: 1, unit: m/s}", "'wind' is not an axis; give one or more of: object_color"),
        ("fog: 60", "fog=60 must be a mapping; give low, high or both, and unit: m of sight"),
        ("fog: {low: 60, unit: km}", "fog.unit='km' is wrong; give .* unit: m of sight"),
        ("fog: {low: 60}", "fog.unit=None is wrong"),
        ("fog: {least: 60, unit: m of sight}", "fog.'least' is unknown"),
        ("fog: {unit: m of sight}", "neither low nor high"),
        ("fog: {low: 60, high: 40, unit: m of sight}", "from 60 to 40, which is less"),
        ("fog: {low: sixty, unit: m of sight}", "fog.low='sixty' is a text"),
        ("fog: {high: .inf, unit: m of sight}", "fog.high=inf is out of range"),
        (
            "camera_yaw: {low: -5, high: 5, unit: degrees}",
            "camera_yaw: limits must be 0 or more because .*, got -5; give low",
        ),
    ],
)
def test_mistakes_get_one_line_that_names_the_file(read, text, message):
    with pytest.raises(InputError, match=message) as error:
        read(text)
    assert "\n" not in str(error.value) and "needs.yaml: " in str(error.value)


def test_no_file(tmp_path):
    with pytest.raises(InputError, match=r"require_domain=.*none\.yaml can't be read"):
        read_requirements(tmp_path / "none.yaml")
