import errno
import multiprocessing
import os
from pathlib import Path

import pytest

from drone_rl.utils.errors import InputError
from drone_rl.utils.files import (
    as_path,
    folder_lock,
    is_locked,
    make_folder,
    newest,
    parse_json,
    read_bytes,
    read_json,
    read_tail,
    refuse_links,
    to_file_name,
    trained_policies,
    write_all_atomically,
    write_atomically,
)


def test_a_file_is_replaced_and_no_other_is_left(tmp_path):
    path = tmp_path / "a.json"
    write_atomically(path, "old")
    write_atomically(path, "new")
    assert path.read_text() == "new"
    assert list(tmp_path.iterdir()) == [path]


def test_the_newest_is_the_one_that_was_changed_last(tmp_path):
    paths = [tmp_path / name for name in ("a", "b", "c")]
    for path, changed in zip(paths, (20, 30, 10), strict=True):
        path.touch()
        os.utime(path, (99, changed))
    assert newest(paths) == tmp_path / "b"
    assert newest([]) is None


def test_trained_policies_are_sorted_by_the_time_of_their_last_checkpoint(tmp_path):
    files = []
    for name, changed in (("runs/a", 20), ("multiruns/s/0", 30), ("runs/b", 10)):
        files.append(tmp_path / "train" / name / "checkpoints" / "last.pt")
        files[-1].parent.mkdir(parents=True)
        files[-1].touch()
        os.utime(files[-1], (99, changed))
    files[0].with_name("best.pt").touch()
    assert trained_policies(tmp_path) == [files[1], files[0], files[2]]
    assert trained_policies(tmp_path / "empty") == []


def test_one_process_locks_a_folder(tmp_path):
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


def test_locks_end_with_their_process(tmp_path):
    process = multiprocessing.get_context("fork").Process(target=_hold_and_die, args=(tmp_path,))
    process.start()
    process.join()
    assert process.exitcode == 9
    assert not is_locked(tmp_path)


def test_links_are_replaced_not_followed(tmp_path):
    canary = tmp_path / "canary"
    canary.write_text("sings")
    (tmp_path / f".a.json.{os.getpid()}").symlink_to(canary)
    (tmp_path / "a.json").symlink_to(canary)
    write_atomically(tmp_path / "a.json", "new")
    assert canary.read_text() == "sings"
    assert not (tmp_path / "a.json").is_symlink()
    (tmp_path / ".lock").symlink_to(canary)
    with pytest.raises(OSError, match="symbolic"), folder_lock(tmp_path):
        pass


def test_plain_files_of_bounded_size_are_read(tmp_path):
    path = tmp_path / "a"
    path.write_bytes(b"1234")
    assert read_bytes(path, 4) == b"1234"
    with pytest.raises(InputError, match="at most 3 bytes"):
        read_bytes(path, 3)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda path: os.mkfifo(path), "no regular file"),
        (lambda path: path.mkdir(), "Is a directory"),
        (lambda path: path.symlink_to("/dev/zero"), "no regular file"),
        (lambda path: path.symlink_to(path), "symbolic links"),
        (lambda path: path.touch(), "is empty"),
        (lambda path: None, "No such file"),
    ],
)
def test_other_files_are_refused_without_waiting(tmp_path, make, message):
    make(tmp_path / "a")
    with pytest.raises(InputError, match=message):
        read_bytes(tmp_path / "a", 9)


def test_json_is_read(tmp_path):
    (tmp_path / "a").write_text('{"a": [1, 2.5, null, true, "ä"]}')
    assert read_json(tmp_path / "a") == {"a": [1, 2.5, None, True, "ä"]}
    assert parse_json(str(2**128 - 1), "x") == 2**128 - 1


@pytest.mark.parametrize(
    "text", [b"[" * 100_000, b"NaN", b"[-Infinity]", b"1e400", b"\xff\xfe", b"{", b"1 2"]
)
def test_other_json_is_refused_in_one_line(text):
    with pytest.raises(InputError, match=r"^x is damaged") as error:
        parse_json(text, "x")
    assert "\n" not in str(error.value)


def test_a_folder_with_a_link_in_it_is_refused(tmp_path):
    (tmp_path / "a" / "b").mkdir(parents=True)
    (tmp_path / "a" / "b" / "file").touch()
    refuse_links(tmp_path)
    (tmp_path / "a" / "b" / "out").symlink_to(tmp_path)
    with pytest.raises(InputError, match="out is a link"):
        refuse_links(tmp_path)
    refuse_links(tmp_path, depth=2)
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="pipe is a link or a device"):
        refuse_links(tmp_path, depth=1)


@pytest.mark.parametrize(
    ("name", "file_name"),
    [
        ("outputs/train/run 3", "outputs_train_run_3"),
        ("../..", "policy"),
        ("a" * 70 + "/b", "a" * 58 + "_b"),
        ("good-1_x", "good-1_x"),
    ],
)
def test_a_name_becomes_that_of_one_file(name, file_name):
    assert to_file_name(name) == file_name


def test_several_files_are_written_or_none(tmp_path):
    (tmp_path / "b").mkdir()
    with pytest.raises(IsADirectoryError) as error:
        write_all_atomically({tmp_path / "a": "1", tmp_path / "b": "2"})
    assert error.value.filename == str(tmp_path / "b")
    assert [path.name for path in tmp_path.iterdir()] == ["b"]
    write_all_atomically({tmp_path / "a": "1", tmp_path / "c": b"2"})
    assert (tmp_path / "a").read_text() + (tmp_path / "c").read_text() == "12"


def test_an_error_of_writing_names_the_file_that_was_to_be_written(tmp_path, monkeypatch):
    def full(*args):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(OSError, match="No space left") as error:
        write_atomically(tmp_path / "a.json", "x")
    assert error.value.filename == str(tmp_path / "a.json")
    assert list(tmp_path.iterdir()) == []


def test_the_end_of_a_log(tmp_path):
    (tmp_path / "log").write_bytes(b"x" * 100 + b"end")
    assert read_tail(tmp_path / "log", 5) == b"xxend"
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="no regular file"):
        read_tail(tmp_path / "pipe", 5)
    with pytest.raises(InputError, match="can't be read"):
        read_tail(tmp_path, 5)


def test_paths_are_text_or_paths():
    assert as_path("a/b", "folder") == as_path(Path("a/b"), "folder") == Path("a/b")
    for wrong in (5, None, ["a"], b"a", ""):
        with pytest.raises(InputError, match=r"^folder="):
            as_path(wrong, "folder")  # pyright: ignore[reportArgumentType]


def test_a_folder_that_cannot_be_made_is_named(tmp_path):
    make_folder(tmp_path / "a" / "b")
    make_folder(tmp_path / "a" / "b")
    assert (tmp_path / "a" / "b").is_dir()
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="Not a directory"):
        make_folder(tmp_path / "file" / "b")
