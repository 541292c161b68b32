"""Times of a page's commands, and of their silences."""

from tools.docs.blocks import read_blocks
from tools.docs.timing import Timing, describe, time_block

PAGE = """\
```sh
echo begun; sleep 0.5; echo done
exit 3                              # exit status 3
exit 4
```
"""


def test_a_block_is_run_to_its_end(tmp_path):
    (tmp_path / "page.md").write_text(PAGE)
    first, second, third = (
        time_block(block, ["bash", "-c", block.code], tmp_path, {"PATH": "/usr/bin:/bin"})
        for block in read_blocks("page.md", tmp_path)
    )
    assert first.code.startswith("echo begun") and first.seconds >= first.silence >= 0.5
    assert first.is_expected and second.is_expected and not third.is_expected
    assert str(third).endswith("exit 4  FAILED")


def test_the_longest_silence_is_named():
    timings = [Timing("a", 60.0, 7.0, True), Timing("b", 30.0, 20.4, True)]
    assert describe("page.md", timings) == "page.md: 1.5 minutes; longest silence 20 s, of: b"
