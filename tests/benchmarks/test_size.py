"""Counts of a small code base, by hand."""

import pytest

from benchmarks.size import KEYS, bench_size

TASK = 'Text.\n\n```python title="post.py"\n"""A task."""\nNAME = 1\n```\n'


@pytest.fixture
def root(tmp_path):
    files = {
        "README.md": "# Name\n\nThree more words.\n",
        "docs/tutorials/task.md": TASK,
        "drone_rl/training/train.py": '"""Train."""\n\nX = 1\n',
        "drone_rl/training/__init__.py": "",
        "tests/training/test_train.py": '"""Tests."""\n',
        "tests/test_training.py": '"""Tests."""\n',
        "benchmarks/size.py": '"""Size."""\n',
        "tools/size.py": '"""Size."""\n',
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path


def test_counts(root):
    found = bench_size(root)
    assert set(found) == {*KEYS, "readme_words", "training_file_lines", "minimal_task_lines"}
    assert (found["package_lines"], found["package_modules"], found["packages"]) == (3, 2, 1)
    assert (found["readme_lines"], found["readme_words"]) == (3, 5)
    assert (found["training_file_lines"], found["minimal_task_lines"]) == (3, 2)


def test_tutorial_without_a_task_raises(root):
    (root / "docs" / "tutorials" / "task.md").write_text("Text.\n")
    with pytest.raises(ValueError, match="unpack"):
        bench_size(root)
