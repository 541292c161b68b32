"""One line for each error of a user, whichever library raised it."""

import errno
import os
import sys
import threading

import pytest
from hydra.core.hydra_config import HydraConfig

from drone_rl.cli.hydra.messages import file_error, guarded, is_output_closed, one_line
from drone_rl.utils.errors import InputError


def raised(error, cause=None):
    try:
        raise error from cause
    except type(error) as caught:
        return caught


def test_control_characters_are_removed():
    assert one_line(InputError("a\nb\x1b[0m")) == "a?b?[0m"
    assert "\n" not in file_error(OSError(errno.EISDIR, "Is a directory", "a\nb"))


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
        *("error: interrupted", "error: no"),
        "error: x can't be opened or written (No such file); check the path, free some "
        "space, or choose another folder with hydra.run.dir=...",
    ]
    with pytest.raises(ZeroDivisionError):
        guarded(lambda: 1 // 0)


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (OSError(errno.ENOSPC, "No space left", "a/b"), ["a/b ", "No space left", "free some"]),
        (OSError(errno.ENOSPC, "No space left"), ["standard output or a file can't"]),
        (OSError(errno.EROFS, "Read-only file system", b"a"), ["a ", "Read-only"]),
    ],
)
def test_an_error_of_the_file_system_has_path_reason_and_remedy(error, words, monkeypatch):
    monkeypatch.setattr(HydraConfig, "initialized", lambda: False)  # as other tests may leave it
    line = one_line(error)
    assert all(word in line for word in [*words, "hydra.run.dir="]), line


def test_an_unusable_log_is_one_line(capsys):
    def command():
        try:
            raise IsADirectoryError(errno.EISDIR, "Is a directory", "train.log")
        except OSError as error:
            raise ValueError("Unable to configure handler 'file'") from error

    assert guarded(command) == 2
    assert capsys.readouterr().err.startswith("error: train.log can't be opened")


def test_an_error_in_a_thread_is_one_line(capsys, monkeypatch):
    monkeypatch.setattr(threading, "excepthook", threading.excepthook)

    def full():
        raise OSError(errno.ENOSPC, "No space left", "events")

    def command():
        thread = threading.Thread(target=full)
        thread.start()
        thread.join()
        return 0

    assert guarded(command) == 0
    assert capsys.readouterr().err.startswith("warning: events can't be opened")


def test_closed_output(monkeypatch):
    reader, writer = os.pipe()
    with os.fdopen(writer, "w") as out:
        monkeypatch.setattr(sys, "stdout", out)
        assert not is_output_closed()
        os.close(reader)
        assert is_output_closed()
