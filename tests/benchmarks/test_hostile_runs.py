"""Folders of runs and sweeps that would be accepted but for one file."""

import stat

import pytest

from benchmarks import hostile_runs as made
from drone_rl.sweeps.manifest import read_sweep
from drone_rl.sweeps.rows import read_rows


def test_the_sweep_that_they_are_made_from_is_accepted(tmp_path):
    sweep = made._sweep(tmp_path / "s", {"0": made._HEADER + made._ROW * 2})
    (row,) = read_rows(read_sweep(sweep))
    assert (row.state, row.curve[0].tolist(), row.entropy) == ("finished", [100, 100], 0.7)


@pytest.mark.parametrize("name", made.METRICS)
def test_metrics_that_are_none_are_damage(tmp_path, name):
    sweep = made._sweep(tmp_path / "s", {"0": made.METRICS[name]})
    assert [row.state for row in read_rows(read_sweep(sweep))] == ["damaged"]


def test_a_lock_is_a_folder_or_a_pipe(tmp_path):
    def run(path):
        (path / ".hydra").mkdir(parents=True)
        (path / "checkpoints").mkdir()
        return path

    cases = made._resumed(tmp_path, run)
    assert (tmp_path / "resumed_lock_folder" / ".lock").is_dir()
    assert stat.S_ISFIFO((tmp_path / "resumed_lock_pipe" / ".lock").stat().st_mode)
    assert stat.S_ISSOCK((tmp_path / "resumed_socket" / "x.socket").stat().st_mode)
    assert all(command[0] == "train" for _, command, _ in cases)
