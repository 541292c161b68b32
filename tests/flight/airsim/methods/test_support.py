"""Tables of methods that the server lacks, or has in part."""

from drone_rl.flight.airsim.methods import METHODS, UNSUPPORTED


def test_no_method_is_both_supported_and_not():
    assert not METHODS.keys() & UNSUPPORTED.keys()
