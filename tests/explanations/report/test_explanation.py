"""An explanation's files are read without trust."""

import json

import numpy as np
import pytest

from drone_rl.explanations.report.explanation import FORMAT, FORMAT_VERSION, Explanation
from drone_rl.utils.errors import InputError


@pytest.fixture
def folder(tmp_path):
    def write(numbers=None, arrays=None):
        given = {"format": FORMAT, "format_version": FORMAT_VERSION, "name": "x"}
        if not isinstance(numbers, str):
            numbers = json.dumps({**given, **(numbers or {})})
        (tmp_path / "explanation.json").write_text(numbers)
        for name in ("arrays", "dataset"):
            np.savez_compressed(tmp_path / f"{name}.npz", **(arrays or {"a": np.arange(3)}))
        return tmp_path

    return write


def test_it_is_read(folder):
    found = Explanation.load(folder({"share": float("nan")}))
    assert found.name == "x"
    assert found.arrays["a"].tolist() == found.data["a"].tolist() == [0, 1, 2]


@pytest.mark.parametrize(
    ("numbers", "arrays", "message"),
    [
        ("[1]", None, "must be a mapping"),
        ("[" * 50_000, None, "nested too deeply"),
        ({"format_version": 1}, None, "format version"),
        ({"name": "a\nb"}, None, "printable"),
        (None, {"a": np.array([{}], dtype=object)}, "no array"),
    ],
)
def test_it_is_refused(folder, numbers, arrays, message):
    with pytest.raises(InputError, match=message):
        Explanation.load(folder(numbers, arrays))


def test_links_are_not_followed(folder, tmp_path):
    here = folder()
    (here / "arrays.npz").rename(here / "b.npz")
    (here / "arrays.npz").symlink_to(here / "b.npz")
    with pytest.raises(InputError, match="is a link"):
        Explanation.load(here)


def test_arrays_that_no_report_shows_take_no_room(explanations):
    shown = Explanation.load(explanations[0])
    assert not any(name.startswith("map_") for name in shown.arrays)
    assert shown.data.keys().isdisjoint({"observations", "regions", "depth"})
