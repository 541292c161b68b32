"""A folder belongs to one sweep."""

import json

import pytest

from drone_rl.sweeps.manifest import open_sweep, read_sweep
from drone_rl.utils.errors import InputError


def begin(folder, runs, **settings):
    return open_sweep(folder, ["drone-rl", "train", "-m", "a=1,2"], settings, runs)


def test_what_is_written_is_read_again(tmp_path, make_runs):
    runs = make_runs("a=1", "a=2")
    begin(tmp_path, runs, seed=0)
    sweep = read_sweep(tmp_path)
    assert sweep.runs == runs
    assert sweep.command == "drone-rl train -m a=1,2"
    assert sweep.settings == {"seed": 0}


def test_the_same_is_gone_on_with_and_more_runs_are_added(tmp_path, make_runs):
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
        ({"command": "rm -rf ~"}, "not a training command"),
        ({"command": "drone-rl train; rm -rf ~"}, "not a training command"),
        ({"settings": [1]}, "must be a mapping"),
        ({"plugins": []}, "'plugins' is unknown"),
        ({"runs": [{"number": 0, "overrides": [], "folder": "../0"}]}, "not inside the sweep's"),
        ({"runs": [{"number": 0, "overrides": [], "folder": "/tmp"}]}, "not inside the sweep's"),
        ({"runs": [{"number": 0, "overrides": [], "folder": ".."}]}, "not inside the sweep's"),
        ({"runs": [{"number": -1, "overrides": [], "folder": "0"}]}, "number=-1"),
        (
            {"runs": [{"number": 0, "overrides": ["a._target_=b"], "folder": "0"}]},
            "not a plain setting",
        ),
        ({"runs": [{"number": 0, "overrides": "a", "folder": "0"}]}, "overrides='a'"),
        ({"runs": [{"number": 0, "overrides": [], "folder": "0"}] * 2}, "two runs"),
        (
            {"runs": [{"number": i, "overrides": [f"seed={i}"], "folder": "0"} for i in (0, 1)]},
            "count twice",
        ),
    ],
)
def test_a_sweep_that_nobody_began(tmp_path, make_runs, change, message):
    begin(tmp_path, make_runs("a=1"))
    path = tmp_path / "sweep.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), **change}))
    with pytest.raises(InputError, match=message):
        read_sweep(tmp_path)


def test_a_run_that_is_a_link_leads_nowhere(tmp_path, make_runs):
    begin(tmp_path, make_runs("a=1"))
    (tmp_path / "0").symlink_to("/")
    with pytest.raises(InputError, match="0 is a link"):
        read_sweep(tmp_path)
    with pytest.raises(InputError, match="0 is a link"):
        begin(tmp_path, make_runs("a=1"))
