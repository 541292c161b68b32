"""`drone-rl prove` as a user calls it."""

import json
import subprocess
import sys

PROGRAM = [sys.executable, "-m", "drone_rl.cli.main"]


def call(*args):
    return subprocess.run([*PROGRAM, *args], capture_output=True, text=True, check=False)


def test_one_cube(tmp_path):
    done = call(
        "prove", "policy=right_and_forward", "task.num_cubes=1", f"hydra.run.dir={tmp_path}"
    )
    assert done.returncode == 15, done.stderr
    assert "0.6375" in done.stdout
    assert json.loads((tmp_path / "certificate.json").read_text())["finished"]


def test_bad_input_is_one_line(tmp_path):
    run = f"hydra.run.dir={tmp_path}"
    for setting, message in (
        ("task.vertical_bound=0.5", "spreads cubes in height"),
        ("logit_gap=-1", "logit_gap"),
        ("policy=nobody", "policy=nobody does not exist"),
    ):
        done = call("prove", "policy=good", setting, run)
        assert done.returncode == 2
        (line,) = done.stderr.strip().splitlines()
        assert message in line
