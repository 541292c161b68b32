"""Malicious certificates differ from a valid one in one part."""

import copy

import pytest

from benchmarks import hostile_claims
from benchmarks.hostile_files import DESCRIPTION
from drone_rl.utils.errors import InputError
from drone_rl.verification.checker.certificate import parse_certificate


def test_the_unchanged_certificate_is_accepted():
    found = parse_certificate(hostile_claims._certificate(DESCRIPTION))
    assert found.outcomes[0].boxes.tolist() == [[[-6.0, 6.0]]]


@pytest.mark.parametrize("name", ["subnormal_border", "many_pairs", "steps_20001", "nine_cubes"])
def test_a_certificate_that_is_slow_to_check_is_refused(name):
    data = copy.deepcopy(hostile_claims._certificate(DESCRIPTION))
    hostile_claims._certificates()[name](data)
    with pytest.raises(InputError):
        parse_certificate(data)


def test_names_of_files_are_unique(tmp_path):
    cases = hostile_claims.hostile_claims(tmp_path, DESCRIPTION)
    assert len({name for name, *_ in cases}) == len(cases) > 40
