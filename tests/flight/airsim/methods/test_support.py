"""Tables of methods that the server lacks, or has in part."""

from drone_rl.flight.airsim.methods import METHODS, PARTLY, UNSUPPORTED


def test_no_method_is_both_supported_and_not():
    assert not METHODS.keys() & UNSUPPORTED.keys()


def test_methods_that_work_in_part_exist():
    assert PARTLY.keys() <= METHODS.keys()
