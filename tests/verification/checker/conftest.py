"""True certificates of the policies that travel with the package, made once."""

import copy
import json

import pytest

from benchmarks.gamed_certificates import certificate_of, steps_of
from drone_rl.verification.checker.certificate import Certificate
from tests.verification.checker.making import of_one_cube


@pytest.fixture(scope="session")
def one_sided_truth():
    return of_one_cube("right_and_forward")


@pytest.fixture
def one_sided(one_sided_truth):
    """Of the policy right_and_forward, one cube: won up to y = 1.65, lost to the left of it."""
    return copy.deepcopy(one_sided_truth)


@pytest.fixture(scope="session")
def two_halves_truth():
    import drone_rl

    policy = drone_rl.load_policy("good").in_task(num_cubes=2)
    boxes = [[[-6.0, 1.0], [-6.0, 6.0]], [[1.0, 6.0], [-6.0, 6.0]]]
    won = {"end": "all_cubes", "collected": [True, True], "loops": False, "share": 1.0}
    return certificate_of(policy, [{**won, "steps": steps_of(policy, 0.97), "boxes": boxes}])


@pytest.fixture
def two_halves(two_halves_truth):
    """Of the policy good, two cubes: all collected, in two boxes, steps of most stated."""
    return copy.deepcopy(two_halves_truth)


@pytest.fixture
def parsed(one_sided):
    return Certificate.read(one_sided)


@pytest.fixture
def write(tmp_path):
    def to_file(data, name="certificate.json"):
        path = tmp_path / name
        path.write_bytes(data if isinstance(data, bytes) else json.dumps(data).encode())
        return path

    return to_file
