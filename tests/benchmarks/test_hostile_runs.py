"""Folders of runs and sweeps that are valid except for one file."""

import stat

import pytest

from benchmarks import hostile_runs
from drone_rl.sweeps.manifest import read_sweep
from drone_rl.sweeps.rows import read_rows


def test_the_unchanged_sweep_is_accepted(tmp_path):
    sweep = hostile_runs._sweep(tmp_path / "s", {"0": hostile_runs._HEADER + hostile_runs._ROW * 2})
    (row,) = read_rows(read_sweep(sweep))
    assert (row.state, row.curve[0].tolist(), row.entropy) == ("finished", [100, 100], 0.7)


@pytest.mark.parametrize("name", hostile_runs.METRICS)
def test_a_run_with_invalid_metrics_is_damaged(tmp_path, name):
    sweep = hostile_runs._sweep(tmp_path / "s", {"0": hostile_runs.METRICS[name]})
    assert [row.state for row in read_rows(read_sweep(sweep))] == ["damaged"]


def test_a_lock_is_a_folder_or_a_pipe(tmp_path):
    def run(path):
        (path / ".hydra").mkdir(parents=True)
        (path / "checkpoints").mkdir()
        return path

    cases = hostile_runs._resumed(tmp_path, run)
    assert (tmp_path / "resumed_lock_folder" / ".lock").is_dir()
    assert stat.S_ISFIFO((tmp_path / "resumed_lock_pipe" / ".lock").stat().st_mode)
    assert stat.S_ISSOCK((tmp_path / "resumed_socket" / "x.socket").stat().st_mode)
    assert all(command[0] == "train" for _, command, _ in cases)
