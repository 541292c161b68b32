"""What is refused before a certificate is quoted."""

import pytest

import drone_rl
from drone_rl.utils.errors import InputError
from drone_rl.verification.checker.checker import read_validated
from tests.verification.checker.making import of_every_place


@pytest.fixture
def good():
    return drone_rl.load_policy("good").in_task(num_cubes=2)


def tried(path, policy):
    return read_validated(path, policy.description, policy.state["policy"])


def test_a_certificate_that_goes_together_is_read(write, good):
    read = tried(write(of_every_place(good, undecided=True)), good)
    assert (read.outcomes[0].share, read.undecided_share) == (0.75, 0.25)
    assert read.task == good.task


@pytest.mark.parametrize(
    ("lie", "message"),
    [
        (lambda c: c["outcomes"][0].update(share=0.9), r"is inconsistent: .*share of 0\.9"),
        (lambda c: c["outcomes"][0]["boxes"].append([[0.0, 1.0]] * 2), "do not partition"),
        (lambda c: c["outcomes"][0].update(boxes=[[[-6.0, 5.0], [-6.0, 6.0]]]), "do not partition"),
        (lambda c: c.update(finished=False), "finished is false"),
        (lambda c: c.update(more=1), r"can't be used: .*more"),
        (lambda c: c["policy"].update(weights="0" * 64), "for a network with hash 0000"),
        (lambda c: c["policy"]["description"]["camera"].update(width=32), "differ in camera"),
    ],
)
def test_what_does_not_is_refused_in_one_line(write, good, lie, message):
    data = of_every_place(good)
    lie(data)
    with pytest.raises(InputError, match=message) as error:
        tried(write(data), good)
    assert "\n" not in str(error.value)


def test_another_task_is_named(write, good):
    with pytest.raises(InputError, match=r"another task: num_cubes=2, not 3"):
        tried(write(of_every_place(good)), good.in_task(num_cubes=3))
    with pytest.raises(InputError, match=r"another task: cube_size=2\.5, not 2\.0"):
        tried(write(of_every_place(good)), good.in_task(cube_size=2.0))
