import json

import pytest

import drone_rl
from drone_rl.bench.evidence import changed
from drone_rl.conditions.measured import read_measured
from drone_rl.utils.errors import InputError
from drone_rl.words.licence import said
from drone_rl.words.shifts import SHIFTS
from tests.conditions.making import shifts_of


@pytest.fixture(scope="module")
def good():
    return drone_rl.load_policy("good")


@pytest.fixture
def read(good, tmp_path):
    """Reads made-up flights, some of which are changed."""

    def build(changes=None, policy=good):
        path = tmp_path / "shifts.json"
        path.write_text(json.dumps(changed(shifts_of(good), changes or {})))
        return read_measured(path, policy.description, policy.state["policy"])

    return build


def test_what_holds_together_is_read(read, good):
    found = read()
    assert found.has_ranges and found.refused is None
    assert found.evidence["domain"]["ranges"]["blur"]["high"] == 1.0
    camera = good.description.camera
    assert [one.shape for one in found.pictures["blur"]] == [(camera.height, camera.width, 3)] * 6
    assert "pictures" not in found.evidence


def test_without_ranges_there_is_no_domain(read):
    assert not read({"domain": None}).has_ranges


def test_of_another_network_or_task_it_is_refused(read, good):
    with pytest.raises(InputError, match="of a network with the hash"):
        read(policy=drone_rl.load_policy("poor"))
    with pytest.raises(InputError, match="of another task"):
        read(policy=good.in_task(num_cubes=2))


_BLUR = "domain.ranges.blur"
_WIDE = {f"{_BLUR}.high": 1.5, f"{_BLUR}.positions": [0.0, 1.5]}
_ALL_GOOD = {f"{_BLUR}.flown.3.good": True, **_WIDE}


@pytest.mark.parametrize(
    ("lie", "message"),
    [
        ({"format": "drone_rl certificate"}, "format='drone_rl certificate' is unknown"),
        ({"axes.blur.levels.0.value": 9.0}, "axes.blur has other strengths"),
        ({"axes.blur.unit": "m"}, "axes.blur has other strengths or units"),
        ({"axes.blur.neutral": 1.0}, "axes.blur has other strengths"),
        ({"axes.blur.levels.0.modes": {}}, "tells nothing of constant"),
        ({"plain.success.share": 0.9}, "share is not what was counted"),
        ({"plain.success.successes": 201}, "share is not what was counted"),
        ({f"{_BLUR}.high": 2.0}, "domain.ranges.blur contradicts"),
        (_WIDE, "domain.ranges.blur contradicts"),
        (_ALL_GOOD, "domain.ranges.blur contradicts"),
        ({**_ALL_GOOD, f"{_BLUR}.failed": [], f"{_BLUR}.high_open": True}, "contradicts"),
        ({f"{_BLUR}.flown.1.good": False}, "domain.ranges.blur contradicts"),
        ({f"{_BLUR}.flown.1.position": 9.0}, "domain.ranges.blur contradicts"),
        ({f"{_BLUR}.failed": []}, "domain.ranges.blur contradicts"),
        ({f"{_BLUR}.high_open": True}, "domain.ranges.blur contradicts"),
        ({"domain.plain.good": False}, "contradicts"),
        ({"settings.good_share": 2.0}, "good_share=2.0 is out of range"),
        ({"seed": 1}, "seed=1 is not settings.seed=0"),
        ({"settings.seed": None}, "seed=0 is not settings.seed=None"),
        ({"seed": -1}, "seed=-1 is out of range"),
        ({"seed_is_fixed": "no"}, "seed_is_fixed='no' is neither true nor false"),
        ({"pictures.blur.0": None}, "does not show the world as it is"),
        ({"pictures.blur.1": "AAAA"}, "is no picture of 25 rows"),
    ],
)
def test_what_does_not_go_together_is_refused(read, lie, message):
    with pytest.raises(InputError, match=message) as error:
        read(lie)
    assert "\n" not in str(error.value) and "shifts.json can't be used" in str(error.value)


def test_a_hole_that_was_left_out_is_missed(read):
    """Who leaves the strength out at which it failed has a range with a gap."""
    made = shifts_of(drone_rl.load_policy("good"))["domain"]["ranges"]["blur"]
    lie = {f"{_BLUR}.flown": [made["flown"][0], *made["flown"][2:]]}
    with pytest.raises(InputError, match="contradicts"):
        read(lie)


def test_a_damaged_file_is_refused(good, tmp_path):
    path = tmp_path / "shifts.json"
    for content in ("{", "[]", "{}", '{"pictures": 3}'):
        path.write_text(content)
        with pytest.raises(InputError, match="can't be used"):
            read_measured(path, good.description, good.state["policy"])


def test_a_file_of_version_0_1_has_a_fixed_seed(good, tmp_path):
    made = shifts_of(good)
    path = tmp_path / "shifts.json"
    del made["seed"]
    path.write_text(json.dumps(made))
    with pytest.raises(InputError, match="one of seed and seed_is_fixed"):
        read_measured(path, good.description, good.state["policy"])
    del made["seed_is_fixed"]
    path.write_text(json.dumps(made))
    measured = read_measured(path, good.description, good.state["policy"])
    assert said(SHIFTS, measured.evidence)["shifts.fixed_seed"].startswith("Fixed seed 0: ")
