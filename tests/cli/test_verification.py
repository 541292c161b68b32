"""`drone-rl prove` as a user calls it."""

import json

import pytest

from tests.cli.running import error_line


def test_one_cube(in_process, tmp_path):
    done = in_process(
        "prove", "policy=right_and_forward", "task.num_cubes=1", f"hydra.run.dir={tmp_path}"
    )
    assert done.returncode == 15, done.stderr
    assert "0.6375" in done.stdout
    assert json.loads((tmp_path / "certificate.json").read_text())["finished"]


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("task.vertical_bound=0.5", "vertical_bound=0.5 is not supported"),
        ("logit_gap=-1", "logit_gap"),
        ("policy=nobody", "policy=nobody does not exist"),
        ("task.num_cubes=6", "fewer cubes"),
    ],
)
def test_bad_input_is_one_line(in_process, tmp_path, setting, message):
    done = in_process("prove", "policy=good", setting, f"hydra.run.dir={tmp_path}")
    assert message in error_line(done)
