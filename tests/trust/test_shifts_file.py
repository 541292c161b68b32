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
    """Reads made-up episodes, some of which are changed."""
    path = tmp_path / "shifts.json"

    def build(changes=None, policy=good, made=None):
        plain = (made or shifts_of(good)).model_dump(mode="json")
        path.write_text(json.dumps(changed(plain, changes or {})))
        return read_shifts(path, policy.description, policy.state.weights)

    return build


def test_valid_file_is_read(read, good):
    made = shifts_of(good, axes=("fog", "sun"))
    found = read({"terms.goal": "certified cube"}, made=made).shifts  # terms are the task's
    assert found == made.replace(image_size=(25, 64))
    assert (found.ranges["fog"].low, found.ranges["fog"].high) == (40.0, None)
    assert [frame.shape for frame in found.frames("fog")] == [(25, 64, 3)] * 6


def test_file_of_another_network_or_task_is_refused(read, good):
    with pytest.raises(InputError, match="for a network with hash"):
        read(policy=drone_rl.load_policy("poor"))
    with pytest.raises(InputError, match="of another task"):
        read(policy=good.in_task(num_cubes=2))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format_version": 3}, "format_version=3"),
        ({"axes": {"wind": {}}}, "wind is no axis"),
        ({"domain": {"ranges": 3}}, "domain.plain is missing"),
        ({"pictures.blur.0": None}, "has no image without perturbation"),
        ({"pictures.blur.1": "AAAA"}, "is not an image of 25 rows"),
    ],
)
def test_wrong_types_are_refused(read, change, message):
    with pytest.raises(InputError, match=message) as error:
        read(change)
    assert "\n" not in str(error.value) and "shifts.json can't be used" in str(error.value)


@pytest.mark.parametrize("name", list(AXES))
def test_every_axis_is_read_as_it_is_written(good, read, name):
    made = shifts_of(good, axes=(name,))
    assert read(made=made).shifts.domain == made.domain
