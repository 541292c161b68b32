"""What a run leaves behind is believed only as far as it is plain."""

import json
import os

import pytest

from drone_rl.sweeps.manifest import Run, read_failure
from drone_rl.utils.readers import read_result


@pytest.mark.parametrize(
    "content",
    [
        "[1]",
        '{"frames": 1}',
        '{"reason": 5}',
        '{"reason": "solved\\u001b[2J"}',
        "[" * 10**5,
    ],
)
def test_a_result_that_no_training_writes_is_none(tmp_path, content):
    (tmp_path / "result.json").write_text(content)
    assert read_result(tmp_path) is None


def test_a_result_is_read_and_a_pipe_is_not_waited_for(tmp_path):
    (tmp_path / "result.json").write_text('{"reason": "solved", "largest_reward": 3}')
    assert read_result(tmp_path) == {"reason": "solved", "largest_reward": 3}
    (tmp_path / "result.json").unlink()
    os.mkfifo(tmp_path / "result.json")
    assert read_result(tmp_path) is None


def test_the_reason_of_a_failure_is_one_line_of_bounded_length(tmp_path):
    run = Run(0, (), tmp_path)
    assert read_failure(run) is None
    run.failure.write_text(json.dumps({"error": "a\x1b[2J\nb" + "c" * 10**5}))
    assert read_failure(run).startswith("a [2J bccc")
    assert len(read_failure(run)) == 1000
