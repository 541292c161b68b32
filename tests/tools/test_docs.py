"""Blocks of pages are found, run and compared; a page that is not true fails."""

import sys

import pytest

from tools.docs.__main__ import main
from tools.docs.blocks import ROOT, find_pages, read_blocks
from tools.docs.outputs import find_difference, find_different_words, normalize
from tools.docs.rules import Rules
from tools.docs.session import FAILED, OTHER_NUMBERS, RAN, Session, update_page

PAGE = """# Page

```sh
# only a remark
echo one two    # exit status 0
false           # exit status 1
```

```console
$ echo "it took 3.1 s"
it took 2.9 s
$ printf 'a\\nb\\nc\\n'
a
[...]
c
```

```python title="part.py"
ONE = 1
```

```python
from part import ONE

print(ONE + 1)
```

It prints

```text
2
```

```diagram
a --> b
```
"""


@pytest.fixture
def write(tmp_path, monkeypatch):
    """Write a page into an empty checkout, which is the current folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "docs").mkdir()

    def page(text):
        (tmp_path / "docs" / "page.md").write_text(text)
        return "docs/page.md"

    yield page
    sys.modules.pop("part", None)


def run(page):
    return Session(page, Rules()).run()


def test_blocks_are_found_in_their_order(write, tmp_path):
    (tmp_path / "README.md").write_text("")
    page = write(PAGE)
    assert find_pages(tmp_path) == ["README.md", page]
    blocks = read_blocks(page, tmp_path)
    assert [block.kind for block in blocks] == ["command"] * 4 + ["python"] * 2
    assert [block.line for block in blocks] == [5, 6, 10, 12, 18, 22]
    assert [block.status for block in blocks] == [0, 1, 0, 0, 0, 0]
    assert [block.title for block in blocks] == [None] * 4 + ["part.py", None]
    assert [block.shown for block in blocks[2:]] == ["it took 2.9 s", "a\n[...]\nc", "", "2"]
    assert blocks[3].shown_lines == (13, 16) and blocks[5].shown_lines == (31, 32)


@pytest.mark.parametrize("text", ["```sh\nls\n", "```text\n1\n```\n", "  ```sh\n"])
def test_a_page_that_is_not_understood_is_refused(write, tmp_path, text):
    with pytest.raises(ValueError, match=r"docs/page\.md:1: "):
        read_blocks(write(text), tmp_path)


def test_every_block_is_run(write):
    assert [outcome.status for outcome in run(write(PAGE))] == [RAN] * 6


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("exit status 1", "exit status 3"),
        ("false           # exit status 1", "false"),
        ("took 2.9", "lasted 2.9"),
        ("[...]\nc\n", "[...]\nd\n"),
        ("text\n2", "text\n3"),
        ("print(ONE + 1)", "print(TWO)"),
        ("print(ONE + 1)", "raise SystemExit"),
        ('```python title="part.py"', "```yaml"),
    ],
)
def test_a_page_that_is_not_true_fails(write, old, new):
    assert old in PAGE
    assert FAILED in [outcome.status for outcome in run(write(PAGE.replace(old, new)))]


@pytest.mark.parametrize(
    ("first", "printed", "status"),
    [
        ("drone-rl train 2>&1 | true", "reward 4", OTHER_NUMBERS),
        ("drone-rl train 2>&1 | true", "loss 3", FAILED),
        ("drone-rl verdict 2>&1 | true", "reward 4", FAILED),
    ],
)
def test_numbers_may_differ_only_after_a_training(write, first, printed, status):
    page = write(f"```console\n$ {first}\n$ echo {printed}\nreward 3\n```\n")
    assert run(page)[-1].status == status


def test_outputs_are_compared_in_order_without_line_breaks():
    assert find_difference("a b [...] c", "x a\nb y c z") is None
    assert find_difference("c [...] a", "a b c") == "a"
    assert find_difference("50%|\r100%| done", "10%\r100%| done\n") is None
    assert normalize("runs/2026-01-02_03-04-05-678901 of 2026-01-02") == "runs/<time> of <date>"
    assert find_difference("3 cubes", "2 cubes") == "3 cubes"
    assert find_different_words("3 cubes, 1.5e-3", "2 cubes, -7.1") is None
    assert find_different_words("3 cubes", "3 pillars") == "0 cubes"


def test_rules_skip_shrink_and_replace(write, tmp_path):
    page = write("```sh\necho a FILE   # comment\necho bc\nls\n```\n")
    blocks = read_blocks(page, tmp_path)
    rules = Rules(
        not_run={"ls": "reason"}, smaller={"echo": "x", "echo b": "y"}, replace={"FILE": "f"}
    )
    assert [rules.why_not_run(block) for block in blocks] == [None, None, "reason"]
    commands = [rules.make_command(block) for block in blocks]
    assert commands == ["echo a f x # comment", "echo bc y", "ls"]


def test_outputs_are_written_into_a_page(write, tmp_path):
    page = write(
        "```sh\necho 1\n```\n\n```text\n```\n\n```console\n$ echo 2\n3\n$ echo 5\n[...]4\n```\n"
    )
    update_page(tmp_path / page, run(page))  # leaves the output that omits text
    assert (tmp_path / page).read_text() == (
        "```sh\necho 1\n```\n\n```text\n1\n```\n\n```console\n$ echo 2\n2\n$ echo 5\n[...]4\n```\n"
    )


def test_a_copy_of_the_checkout_runs_a_page(tmp_path):
    """Commands find the program of the copy."""
    for name in ("drone_rl/cli", "conf", "examples", "benchmarks", "docs"):
        (tmp_path / name).mkdir(parents=True)
    cli = tmp_path / "drone_rl" / "cli"
    for path in (cli.parent / "__init__.py", cli / "__init__.py"):
        path.touch()
    (cli / "main.py").write_text("print('the copy')")
    (tmp_path / "README.md").write_text("```console\n$ drone-rl train\nthe original\n```\n")
    (tmp_path / "tools").symlink_to(ROOT / "tools")
    assert main(["README.md"], tmp_path) == 1
    assert main(["--update", "README.md"], tmp_path) == 1
    assert "the copy" in (tmp_path / "README.md").read_text()
    assert main(["README.md"], tmp_path) == 0
    assert main(["docs/none.md"], tmp_path) == 2
