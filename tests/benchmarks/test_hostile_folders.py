import stat

import pytest

from benchmarks.hostile_files import checkpoint_state
from benchmarks.hostile_folders import hostile_folders


@pytest.fixture(scope="module")
def cases(tmp_path_factory):
    folder = tmp_path_factory.mktemp("hostile")
    (folder / "canary").mkdir()
    return folder, hostile_folders(folder, checkpoint_state())


def test_runs_sweeps_and_explanations_are_opened_by_their_commands(cases):
    _, found = cases
    commands = {command[0] for _, command, _ in found}
    assert {"train", "sweep-report", "report"} <= commands
    assert len({name for name, *_ in found}) == len(found)


def test_arrays_can_be_a_pipe_or_an_endless_device(cases):
    folder, _ = cases
    pipe = folder / "explanation_pipe" / "arrays.npz"
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    endless = folder / "explanation_zeros" / "arrays.npz"
    assert endless.is_symlink() and str(endless.readlink()) == "/dev/zero"
