"""The files of the user whose task the benchmark measures."""

from pathlib import Path

from benchmarks.own_task import measuring
from tools.docs.blocks import read_blocks


def test_the_tutorial_has_the_measured_files():
    blocks = {b.title: b.code for b in read_blocks("docs/tutorials/terms.md") if b.title}
    folder = Path(measuring.__file__).parent
    assert set(blocks) == {measuring.TASK, measuring.TERM}
    for name, code in blocks.items():
        assert code.strip() == (folder / name).read_text().strip()
