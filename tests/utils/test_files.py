"""Whole files and locked folders."""

import multiprocessing
import os

import pytest

from drone_rl.utils.errors import InputError
from drone_rl.utils.files import folder_lock, is_locked, write_atomically


def test_a_file_is_replaced_whole_and_nothing_is_left_beside_it(tmp_path):
    path = tmp_path / "a.json"
    write_atomically(path, "old")
    write_atomically(path, "new")
    assert path.read_text() == "new"
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_has_one_holder_at_a_time(tmp_path):
    assert not is_locked(tmp_path)
    with folder_lock(tmp_path):
        assert is_locked(tmp_path)
        with (
            pytest.raises(InputError, match="another process is at work"),
            folder_lock(tmp_path, patience_s=0.1),
        ):
            pass
    assert not is_locked(tmp_path)


def _hold_and_die(folder):
    with folder_lock(folder):
        os._exit(9)


def test_a_dead_process_holds_nothing(tmp_path):
    process = multiprocessing.get_context("fork").Process(target=_hold_and_die, args=(tmp_path,))
    process.start()
    process.join()
    assert process.exitcode == 9
    assert not is_locked(tmp_path)
