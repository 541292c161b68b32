"""One line, whoever noticed the mistake."""

import pytest
from hydra.errors import HydraException
from omegaconf.errors import OmegaConfBaseException

from drone_rl.hydra_app.messages import guarded, one_line
from drone_rl.utils.errors import InputError


def raised(error, cause=None):
    try:
        raise error from cause
    except type(error) as caught:
        return caught


def test_our_own_word_counts_wherever_it_was_said():
    ours = InputError("seed=-1 is out of range; give 0 or more")
    assert one_line(raised(HydraException("Error in\ncall"), ours)) == str(ours)


def test_what_a_file_says_can_not_leave_its_line():
    assert one_line(InputError("a\nb\x1b[0m")) == "a?b?[0m"


def test_hydras_where_and_omegaconfs_what():
    what = OmegaConfBaseException("Value 'x' is no Integer\n  full_key: a")
    assert one_line(raised(HydraException("Error merging a=x"), what)) == (
        "Error merging a=x: Value 'x' is no Integer"
    )


@pytest.mark.parametrize(
    ("text", "remedy"),
    [
        ("Could not override 'x'", "--help"),
        ("Key 'x' is not in struct", "--help"),
        ("BasicSweeper does not support sweep type: INTERVAL", "hydra/sweeper=optuna"),
    ],
)
def test_what_hydra_leaves_out(text, remedy):
    assert remedy in one_line(HydraException(text))


def test_statuses(capsys):
    def fail(error):
        def command():
            raise error

        return command

    assert guarded(lambda: 11) == 11
    assert guarded(fail(KeyboardInterrupt())) == 130
    assert guarded(fail(InputError("no"))) == 2
    assert guarded(fail(FileNotFoundError(2, "No such file", "x"))) == 2
    assert capsys.readouterr().err.splitlines() == [
        *("error: interrupted", "error: no", "error: [Errno 2] No such file: 'x'"),
    ]
    with pytest.raises(ZeroDivisionError):
        guarded(lambda: 1 // 0)
