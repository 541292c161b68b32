import json

import pytest

import drone_rl
from drone_rl.trust.axes import AXES
from drone_rl.trust.shifts_file import read_shifts
from drone_rl.utils.errors import InputError
from tests.evidence import changed
from tests.trust.making import shifts_of


@pytest.fixture(scope="module")
def good():
    return drone_rl.load_policy("good")


@pytest.fixture
def read(good, tmp_path):
    """Reads made-up flights, some of which are changed."""

    def build(changes=None, policy=good):
        path = tmp_path / "shifts.json"
        path.write_text(json.dumps(changed(shifts_of(good), changes or {})))
        return read_shifts(path, policy.description, policy.state["policy"])

    return build


def test_valid_file_is_read(read, good):
    found = read()
    assert found.has_ranges and found.refused is None
    assert found.evidence["domain"]["ranges"]["blur"]["high"] == 1.0
    camera = good.description.camera
    assert [one.shape for one in found.pictures["blur"]] == [(camera.height, camera.width, 3)] * 6
    assert "pictures" not in found.evidence


def test_file_of_an_earlier_version_with_tests_of_pairs_is_read(read):
    paired = {"lost": 3, "gained": 0, "p": 0.25}
    assert read({"axes.blur.levels.0.modes.constant.paired": paired}).refused is None


def test_file_without_ranges(read):
    assert not read({"domain": None}).has_ranges


def test_file_of_another_network_or_task_is_refused(read, good):
    with pytest.raises(InputError, match="for a network with hash"):
        read(policy=drone_rl.load_policy("poor"))
    with pytest.raises(InputError, match="of another task"):
        read(policy=good.in_task(num_cubes=2))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format": "drone_rl certificate"}, "format='drone_rl certificate' is unknown"),
        ({"axes.blur.levels.0.modes.drifting": 3}, "drifting"),
        ({"settings.good_share": 2.0}, "good_share=2.0"),
        ({"seed": -1}, "seed=-1"),
        ({"seed_is_fixed": "no"}, "seed_is_fixed='no': it must be true or false"),
        ({"pictures.blur.0": None}, "has no image without perturbation"),
        ({"pictures.blur.1": "AAAA"}, "is not an image of 25 rows"),
    ],
)
def test_wrong_types_are_refused(read, change, message):
    with pytest.raises(InputError, match=message) as error:
        read(change)
    assert "\n" not in str(error.value) and "shifts.json can't be used" in str(error.value)


def fog_of(good):
    """Good down to 40 m of visibility, and the same with low and high exchanged."""
    made = shifts_of(good, axes=("fog",))
    found = made["domain"]["ranges"]["fog"]
    assert (found["low"], found["high"]) == (40.0, None)
    assert (found["low_open"], found["high_open"]) == (False, None)
    assert found["positions"] == [0.0, 1 / 40]
    assert [failed["end"] for failed in found["failed"]] == ["low"]
    swapped = {"low": None, "high": 40.0, "low_open": None, "high_open": False}
    first = {f"domain.ranges.fog.{key}": value for key, value in swapped.items()}
    return made, changed(made, {**first, "domain.ranges.fog.failed.0.end": "high"})


def test_ends_of_an_inverse_axis_and_other_formats(good, tmp_path):
    made, _ = fog_of(good)
    path = tmp_path / "shifts.json"
    path.write_text(json.dumps(made))
    found = read_shifts(path, good.description, good.state["policy"])
    assert found.numbers["domain"] == made["domain"]
    for version in (1, 3):
        path.write_text(json.dumps({**made, "format_version": version}))
        with pytest.raises(InputError, match=f"format_version={version}"):
            read_shifts(path, good.description, good.state["policy"])


@pytest.mark.parametrize("broken", [3, {"ranges": 3}, {"ranges": {"fog": 3}}])
def test_a_damaged_first_format_gets_one_line(good, tmp_path, broken):
    path = tmp_path / "shifts.json"
    path.write_text(json.dumps({**fog_of(good)[1], "domain": broken}))
    with pytest.raises(InputError, match=r"shifts\.json can't be used"):
        read_shifts(path, good.description, good.state["policy"])


@pytest.mark.parametrize("name", list(AXES))
def test_every_axis_is_read_as_it_is_written(good, tmp_path, name):
    made = shifts_of(good, axes=(name,))
    path = tmp_path / "shifts.json"
    path.write_text(json.dumps(made))
    found = read_shifts(path, good.description, good.state["policy"]).numbers
    assert found["domain"]["ranges"][name]["positions"] == sorted(
        made["domain"]["ranges"][name]["positions"]
    )


def test_a_damaged_file_is_refused(good, tmp_path):
    path = tmp_path / "shifts.json"
    for content in ("{", "[]", "{}", '{"pictures": 3}'):
        path.write_text(content)
        with pytest.raises(InputError, match="can't be used"):
            read_shifts(path, good.description, good.state["policy"])


def test_the_vocabulary_is_that_of_the_task(read):
    assert read({"terms.goal": "certified cube"}).numbers["terms"]["goal"] == "cube"
