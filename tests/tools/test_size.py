"""Hand-counted values of a small package."""

import json

import pytest

from tools.size import ROOT, find_importers, find_phrases, main, measure

TASK = 'Text.\n\n```python title="post.py"\n"""A task."""\nNAME = 1\n```\n'


@pytest.fixture
def checkout(tmp_path):
    """Return a checkout with two packages, a benchmark and a test."""
    files = {
        "drone_rl/__init__.py": "",
        "drone_rl/a/__init__.py": "",
        "drone_rl/a/once.py": "# pyright: basic\nx = 1\n",
        "drone_rl/a/twice.py": "from drone_rl.a import once\n",
        "drone_rl/a/long.py": "x = 1\n" * 60,
        "drone_rl/a/a_kernel.py": "# pyright: basic\n",
        "drone_rl/b/user.py": '"""An image."""\nfrom ..a import long, twice\n',
        "benchmarks/b.py": "import drone_rl.a.twice\n",
        "tests/a/test_once.py": "1\n" * 5,
        "drone_rl/training/train.py": '"""Train."""\n\nX = 1\n',
        "tests/training/test_train.py": "1\n",
        "docs/tutorials/task.md": TASK,
        "README.md": "A picture\n",
    }
    for name, text in files.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return tmp_path


def test_measure_returns_the_hand_counted_values(checkout):
    found = measure(checkout)
    assert found == {
        "package_lines": 69,
        "package_modules": 8,
        "packages": 3,
        "single_use_modules": 1,  # once: long has 60 lines, twice has two importers
        "type_suppressions": 1,
        "flagged_phrases": 1,
        "readme_lines": 1,
        "readme_words": 2,
        "training_file_lines": 3,
        "minimal_task_lines": 2,
        "test_lines_per_line": 0.09,
        "longest_module": [60, "drone_rl/a/long.py"],
        "modules_without_test": ["a/a_kernel", "a/long", "a/twice", "b/user"],
    }


def test_tutorial_without_a_task_raises(checkout):
    (checkout / "docs" / "tutorials" / "task.md").write_text("Text.\n")
    with pytest.raises(ValueError, match="unpack"):
        measure(checkout)


def test_find_importers_resolves_absolute_and_relative_imports(checkout):
    found = find_importers(checkout)
    assert found["drone_rl.a.once"] == {"drone_rl.a.twice"}
    assert found["drone_rl.a.twice"] == {"drone_rl.b.user", "benchmarks.b"}
    assert found["drone_rl.a.long"] == {"drone_rl.b.user"}


def test_a_relative_import_in_init_resolves_to_its_package(checkout):
    (checkout / "drone_rl/a/__init__.py").write_text("from .long import x\nfrom . import once\n")
    found = find_importers(checkout)
    assert "drone_rl.a" in found["drone_rl.a.long"] and "drone_rl.a" in found["drone_rl.a.once"]


def test_prose_of_python_is_comments_and_strings_with_spaces(tmp_path):
    path = tmp_path / "a.py"
    path.write_text('picture = "picture"\nother = "a picture"\n# pictures are drawn anew\n')
    found = list(find_phrases([path]))
    assert [(p.line, p.text) for p in found] == [(2, "picture"), (3, "anew"), (3, "pictures")]
    assert found[0].advice == "image, frame, observation"


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("It is told of that", 1),
        ("Whoever flies, and one who draws", 2),
        ("What is drawn", 1),
        ("It says what is drawn", 0),
        ("it stands alone", 2),  # both "stands alone" and "only"
        ("the way there and back", 1),
        ("nothing to rewrite here", 0),
    ],
)
def test_find_phrases_counts_phrases(tmp_path, text, count):
    path = tmp_path / "a.md"
    path.write_text(text)
    assert len(list(find_phrases([tmp_path]))) == count


def test_main_prints_counts_or_phrases(capsys, checkout):
    main([])
    printed = json.loads(capsys.readouterr().out)
    assert printed["package_modules"] == len([*(ROOT / "drone_rl").rglob("*.py")])
    main([str(checkout / "README.md")])
    assert capsys.readouterr().out.endswith(
        "README.md:1: 'picture': write image, frame, observation\n"
    )
