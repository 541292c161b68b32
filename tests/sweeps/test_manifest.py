"""Manifests, names and files of sweeps."""

import json
import os

import pytest

from drone_rl.sweeps.manifest import (
    Run,
    is_sweep,
    open_sweep,
    read_failure,
    read_sweep,
    sweep_name,
)
from drone_rl.utils.errors import InputError
from drone_rl.utils.run_result import RunResult, read_result


def begin(folder, runs, **settings):
    return open_sweep(folder, ["drone-rl", "train", "-m", "a=1,2"], settings, runs)


def test_a_manifest_is_read_as_written(tmp_path, make_runs):
    runs = make_runs("a=1", "a=2")
    begin(tmp_path, runs, seed=0)
    sweep = read_sweep(tmp_path)
    assert sweep.runs == tuple(runs)
    assert sweep.command == "drone-rl train -m a=1,2"
    assert sweep.settings == {"seed": 0}


def test_a_sweep_is_resumed_with_more_runs(tmp_path, make_runs):
    begin(tmp_path, make_runs("a=1"))
    begin(tmp_path, make_runs("a=1", "a=2"))
    assert len(begin(tmp_path, make_runs("a=1")).runs) == 2


def test_another_sweep_is_refused(tmp_path, make_runs):
    begin(tmp_path, make_runs("a=1", "a=2"))
    with pytest.raises(InputError, match=r"another sweep.*a=1,2.*another folder"):
        begin(tmp_path, make_runs("b=1", "b=2"))


def test_a_setting_that_has_changed_since_is_named(tmp_path, make_runs):
    begin(tmp_path, make_runs("a=1"), task={"num_cubes": 3})
    with pytest.raises(InputError, match=r"task.num_cubes=5.*task.num_cubes=3"):
        begin(tmp_path, make_runs("a=1"), task={"num_cubes": 5})


def test_runs_of_something_else_are_refused(tmp_path, make_runs):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "run.yaml").touch()
    with pytest.raises(InputError, match="holds other runs"):
        begin(tmp_path, make_runs("a=1"))


def test_no_sweep_and_a_damaged_one(tmp_path):
    with pytest.raises(InputError, match="not the folder of a sweep"):
        read_sweep(tmp_path)
    (tmp_path / "sweep.json").write_text(json.dumps({"runs": [{}]}))
    with pytest.raises(InputError, match="damaged"):
        read_sweep(tmp_path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"command": "drone-rl train; rm -rf ~"}, "must be a training command"),
        ({"plugins": []}, "plugins is unknown"),
        ({"runs": [{"number": 0, "overrides": [], "folder": "../0"}]}, "not inside the sweep's"),
        (
            {"runs": [{"number": 0, "overrides": ["a._target_=b"], "folder": "0"}]},
            "not a plain setting",
        ),
    ],
)
def test_a_damaged_or_malicious_manifest(tmp_path, make_runs, change, message):
    begin(tmp_path, make_runs("a=1"))
    path = tmp_path / "sweep.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), **change}))
    with pytest.raises(InputError, match=message):
        read_sweep(tmp_path)


def test_links_are_refused(tmp_path, make_runs):
    begin(tmp_path, make_runs("a=1"))
    (tmp_path / "0").symlink_to("/")
    with pytest.raises(InputError, match="0 is a link"):
        read_sweep(tmp_path)
    with pytest.raises(InputError, match="0 is a link"):
        begin(tmp_path, make_runs("a=1"))


def test_runs_in_one_folder_are_refused(tmp_path):
    begin(tmp_path, [Run(0, ("a=1",), tmp_path / "x")])
    with pytest.raises(InputError, match="count twice"):
        begin(tmp_path, [Run(1, ("a=2",), tmp_path / "x")])


def test_which_command_lines_are_sweeps():
    assert is_sweep(["-m", "seed=0,1"]) and is_sweep(["sweep=seeds"])
    assert not is_sweep(["seed=0"]) and not is_sweep(["sweep=seeds", "hydra.mode=RUN"])


def test_the_name_of_a_sweep_depends_on_its_settings_alone():
    name = sweep_name(["-m", "seed=0,1", "returns=reward_to_go"])
    assert name.startswith("seed-")
    elsewhere = ["seed=0,1", "returns=reward_to_go", "hydra/launcher=slurm", "paths.outputs=x"]
    assert sweep_name([*elsewhere, "hydra.launcher.num_jobs=3", "--multirun"]) == name
    names = {sweep_name(o) for o in (["seed=0,1"], ["seed=0,2"], ["seed=0,1", "task=x"], [])}
    assert len(names) == 4
    assert sweep_name(["sweep=learning_rate"]).startswith("learning_rate-")


@pytest.mark.parametrize("content", ['{"largest_reward": 3}', "[" * 10**5])
def test_a_damaged_result_is_none(tmp_path, content):
    (tmp_path / "result.json").write_text(content)
    assert read_result(tmp_path) is None


def test_results(tmp_path):
    path = tmp_path / "result.json"
    path.write_text('{"reason": "solved", "largest_reward": 3}')
    assert read_result(tmp_path) == RunResult(reason="solved", largest_reward=3)
    path.write_text('{"reason": "SIGTERM", "largest_reward": 3}')  # a stopped run is unfinished
    assert read_result(tmp_path) is None
    path.unlink()
    os.mkfifo(path)
    assert read_result(tmp_path) is None


def test_the_reason_of_a_failure_is_one_line_of_bounded_length(tmp_path):
    run = Run(0, (), tmp_path)
    assert read_failure(run) is None
    run.failure.write_text(json.dumps({"error": "a\x1b[2J\nb" + "c" * 10**5}))
    assert read_failure(run).startswith("a [2J bccc")
    assert len(read_failure(run)) == 1000
