import gc

import pytest

from drone_rl.utils.garbage import collecting_no_garbage


def test_the_collector_rests_and_goes_on():
    assert gc.isenabled()
    with collecting_no_garbage():
        assert not gc.isenabled()
        with collecting_no_garbage():
            assert not gc.isenabled()
        assert not gc.isenabled()
    assert gc.isenabled()


def test_it_goes_on_after_an_error():
    with pytest.raises(KeyError), collecting_no_garbage():
        raise KeyError
    assert gc.isenabled()
