"""Certificates are true ones but for one part."""

import copy

import pytest

from benchmarks import hostile_claims as made
from benchmarks.hostile_files import DESCRIPTION
from drone_rl.utils.errors import InputError
from drone_rl.verification.checker.certificate import parse_certificate


def test_the_one_that_they_are_made_from_is_accepted():
    found = parse_certificate(made._certificate(DESCRIPTION))
    assert found.outcomes[0].boxes.tolist() == [[[-6.0, 6.0]]]


@pytest.mark.parametrize("name", ["subnormal_border", "many_pairs", "steps_20001", "nine_cubes"])
def test_parts_that_would_take_long(name):
    data = copy.deepcopy(made._certificate(DESCRIPTION))
    made._certificates()[name](data)
    with pytest.raises(InputError):
        parse_certificate(data)


def test_files_have_names_of_their_own(tmp_path):
    cases = made.hostile_claims(tmp_path, DESCRIPTION)
    assert len({name for name, *_ in cases}) == len(cases) > 40
