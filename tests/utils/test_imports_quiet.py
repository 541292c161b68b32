import os

from drone_rl.utils.imports import standard_error_closed


def test_nothing_gets_through_to_standard_error_until_it_is_open_again(capfd):
    with standard_error_closed():
        os.write(2, b"from below")
    os.write(2, b"again")
    assert capfd.readouterr().err == "again"
