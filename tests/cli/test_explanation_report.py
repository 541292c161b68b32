"""A report of what is not there; tests/cli/test_explain makes a real one."""

import pytest

from tests.cli.running import error_line


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (["report"], ["explanations=latest", "drone-rl explain first"]),
        (["report", "explanations=nowhere"], ["nowhere", "explanation.json"]),
    ],
)
def test_mistakes_get_one_line(in_process, command, words):
    line = error_line(in_process(*command))
    assert all(word in line for word in words), line
