"""Blocks of pages are found, run and compared; a page that is not true fails."""

import dataclasses
import json
import sys

import pytest

from tools.docs import run
from tools.docs.__main__ import main
from tools.docs.blocks import find_pages, read_blocks
from tools.docs.outputs import find_difference, find_different_words, normalize
from tools.docs.rules import Rules, rules_for
from tools.docs.session import (
    FAILED,
    NOT_RUN,
    OTHER_NUMBERS,
    RAN,
    SMALLER,
    Outcome,
    Session,
)
from tools.docs.update import update_page

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
    """Writes a page into an empty checkout, which is the current folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "docs").mkdir()

    def page(text):
        (tmp_path / "docs" / "page.md").write_text(text)
        return "docs/page.md"

    yield page
    sys.modules.pop("part", None)


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


@pytest.mark.parametrize(
    ("comment", "status"),
    [
        ("exit status 15: not all succeed", 15),
        ("exit status 17 unless good", 0),
        ("exit status 0 if the certificate holds, else 14", 0),
    ],
)
def test_the_expected_exit_status_is_that_of_the_comment(write, tmp_path, comment, status):
    (block,) = read_blocks(write(f"```sh\nls    # {comment}\n```\n"), tmp_path)
    assert block.status == status


@pytest.mark.parametrize(
    ("text", "why"),
    [("```sh\nls\n", "not closed"), ("```text\n1\n```\n", "nothing"), ("  ```sh\n", "fence")],
)
def test_a_page_that_is_not_understood_is_refused(write, tmp_path, text, why):
    with pytest.raises(ValueError, match=why):
        read_blocks(write(text), tmp_path)


def test_every_block_is_run(write):
    write(PAGE)
    outcomes = list(Session("docs/page.md").run())
    assert [(outcome.status, outcome.why) for outcome in outcomes] == [(RAN, "")] * 6


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("exit status 1", "exit status 3", "exit status 1 instead of 3"),
        ("false           # exit status 1", "false", "exit status 1 instead of 0"),
        ("took 2.9", "lasted 2.9", "it lasted <n> s"),
        ("[...]\nc\n", "[...]\nd\n", "d"),
        ("text\n2", "text\n3", "3"),
        ("print(ONE + 1)", "print(TWO)", "NameError"),
        ("print(ONE + 1)", "raise SystemExit", "SystemExit"),
        ('```python title="part.py"', "```yaml", "neither run nor listed"),
    ],
)
def test_a_page_that_is_not_true_fails(write, old, new, why):
    assert old in PAGE
    write(PAGE.replace(old, new))
    failed = [o.why for o in Session("docs/page.md").run() if o.status == FAILED]
    assert any(why in reason for reason in failed), failed


@pytest.mark.parametrize(
    ("first", "printed", "status"),
    [
        ("drone-rl train 2>&1 | true", "reward 4", OTHER_NUMBERS),
        ("drone-rl train 2>&1 | true", "loss 3", FAILED),
        ("drone-rl train 2>&1 | true", "reward 3", RAN),
        ("drone-rl verdict 2>&1 | true", "reward 4", FAILED),
    ],
)
def test_numbers_may_differ_only_after_a_training(write, first, printed, status):
    write(f"```console\n$ {first}\n$ echo {printed}\nreward 3\n```\n")
    *_, outcome = Session("docs/page.md").run()
    assert outcome.status == status


def test_outputs_are_compared_in_order_without_line_breaks():
    assert find_difference("a b [...] c", "x a\nb y c z") is None
    assert find_difference("c [...] a", "a b c") == "a"
    assert find_difference("", "anything") is None
    assert find_difference("50%|\r100%| done", "10%\r100%| done\n") is None
    assert normalize("\x1b[1mbold\x1b[0m  text\n") == "bold text"
    assert normalize("runs/2026-01-02_03-04-05-678901 of 2026-01-02") == "runs/<time> of <date>"
    assert normalize("seed 1234567, 1,234 frames/s") == "seed <n>, <n> frames/s"
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
    whole = dataclasses.replace(rules, smaller={"echo": "x", "echo b": ""})
    assert [whole.is_smaller(block) for block in blocks] == [True, False, False]
    assert whole.make_command(blocks[1]) == "echo bc"
    assert rules.is_smaller(blocks[1]) and not rules.is_smaller(blocks[2])
    assert rules.find_unused(blocks) == []
    needs = Rules(needs={"echo a": "no_such_package", "ls": "json"})
    found = [needs.why_not_run(block) for block in blocks]
    assert found == ["needs the package no_such_package", None, None]
    assert Rules(not_run={"cat": ""}, replace={"RUN": ""}).find_unused(blocks) == ["cat", "RUN"]
    both = rules_for(page, {"all": rules, page: Rules(not_run={"x": "y"}, before=["ls"])})
    assert both.not_run == {"ls": "reason", "x": "y"} and both.before == ["ls"]


def test_outputs_are_written_into_a_page(write, tmp_path):
    page = write(
        "```sh\necho 1\n```\n\n```text\n```\n\n```console\n$ echo 2\n3\n$ echo 5\n[...]4\n```\n"
    )
    outcomes = list(Session(page).run())
    assert [o.status for o in outcomes] == [RAN, FAILED, FAILED]
    assert len(update_page(page, outcomes, tmp_path)) == 1  # it omits text
    assert (tmp_path / page).read_text() == (
        "```sh\necho 1\n```\n\n```text\n1\n```\n\n```console\n$ echo 2\n2\n$ echo 5\n[...]4\n```\n"
    )


def test_pages_are_counted_and_finished_ones_are_kept(monkeypatch, tmp_path):
    def run_in_copy(page, folder, root):
        ran.append(page)
        folder.parent.mkdir(parents=True, exist_ok=True)
        first = [Outcome(1, "a", RAN), Outcome(2, "b", SMALLER), Outcome(4, "d", OTHER_NUMBERS)]
        return [*first, Outcome(3, "c", last, "because")]

    ran, last = [], NOT_RUN
    monkeypatch.setattr(run, "_run_in_copy", run_in_copy)
    monkeypatch.setattr(run.run_page, "__defaults__", (tmp_path / "kept", run.ROOT))
    counts = {
        "docs_blocks": 8,
        "docs_blocks_run": 6,
        "docs_blocks_smaller": 2,
        "docs_blocks_other_numbers": 2,
        "docs_pages": 2,
    }
    for _ in range(2):
        assert run.measure(["README.md", "docs/tour.md"]) == counts
    assert ran == ["README.md", "docs/tour.md"]
    last = FAILED
    with pytest.raises(RuntimeError, match=r"docs/onnx\.md:3: c: because"):
        run.measure(["docs/onnx.md"])
    assert main(["docs/onnx.md"]) == 1 and main(["docs/tour.md"]) == 0
    assert main(["docs/none.md"]) == 2


def test_a_copy_of_the_checkout_runs_a_page(tmp_path):
    """Commands find the program of the copy."""
    for name in ("drone_rl", "conf", "examples", "benchmarks"):
        (tmp_path / name).mkdir()
    cli = tmp_path / "drone_rl" / "cli"
    cli.mkdir()
    for path in (cli.parent / "__init__.py", cli / "__init__.py"):
        path.touch()
    (cli / "main.py").write_text("print('the copy')")
    (tmp_path / "docs").mkdir()
    (tmp_path / "README.md").write_text("```console\n$ drone-rl train\nthe copy\n```\n")
    (tmp_path / "tools").symlink_to(run.ROOT / "tools")
    (outcome,) = run.run_page("README.md", tmp_path / "out", tmp_path)
    assert outcome.status == RAN, outcome
    kept = json.loads((tmp_path / "out" / "README.json").read_text())
    assert kept["outcomes"][0]["printed"] == "the copy\n"
    (tmp_path / "docs" / "table.md").write_text("| no | blocks |\n")
    assert run.run_page("docs/table.md", tmp_path / "out", tmp_path) == []
