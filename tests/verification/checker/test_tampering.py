import pytest

from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from drone_rl.verification.check import check
from tests.verification.checker.tampering import BYTES, CHANGES, tampered


def is_accepted(path):
    try:
        return check(path, flights=400, seed=0, progress=silent).accepted
    except InputError:
        return False


@pytest.mark.parametrize("name", [*BYTES, *CHANGES])
def test_a_tampered_certificate_is_rejected(one_sided, write, name):
    assert not is_accepted(write(tampered(one_sided)[name]))


def test_the_certificate_itself_is_accepted(one_sided, write):
    assert is_accepted(write(one_sided))
