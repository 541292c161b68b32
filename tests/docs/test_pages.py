"""What pages say of the program: commands that it knows, names and files that are there."""

import ast
import re
import tomllib

import pytest

import drone_rl
from tests.docs.commands import check_command, check_commands
from tests.docs.conftest import ROOT
from tools.docs.blocks import COMMAND, PYTHON, find_pages, read_blocks
from tools.docs.rules import ALL, FILE, read_rules

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
LANGUAGE = r"^```{}\n(.*?)^```$"


def blocks(page, language):
    """The blocks of a page in one language."""
    return re.findall(LANGUAGE.format(language), page.read_text(), re.DOTALL | re.MULTILINE)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_commands_are_known(page):
    for block in read_blocks(page.relative_to(ROOT).as_posix()):
        is_valid = block.code.startswith("drone-rl ") and block.status not in (1, 2)
        if block.kind == COMMAND and is_valid and "plugins=" not in block.code:
            assert check_commands(block.code)


@pytest.mark.parametrize("page", find_pages())
def test_every_block_is_run_or_listed_with_a_reason(page):
    blocks, rules = read_blocks(page), read_rules(page)
    for block in blocks:
        is_run = block.kind in (COMMAND, PYTHON) or block.title
        assert is_run or rules.why_not_run(block), f"{page}:{block.line}"


def test_every_rule_applies_to_a_block():
    for page, section in tomllib.loads(FILE.read_text()).items():
        codes = [
            b.code for name in (find_pages() if page == ALL else [page]) for b in read_blocks(name)
        ]
        for key in (*section.get("not_run", ()), *section.get("smaller", ())):
            assert any(code.startswith(key) for code in codes), (page, key)
        for key in section.get("replace", ()):
            assert any(key in code for code in codes), (page, key)


def test_a_command_that_is_unknown_is_found():
    with pytest.raises(AssertionError):
        check_commands("drone-rl walk")
    with pytest.raises(Exception, match="num_cubs"):
        check_commands("X=1 drone-rl train task.num_cubs=3  # more of them\n")
    check_command("train", "seed=1,2", "returns=reward_to_go,leave_one_out", "-m")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_names_are_public(page):
    code = "\n".join(blocks(page, "python"))
    used = {
        node.attr
        for node in ast.walk(ast.parse(code))
        if isinstance(node, ast.Attribute)
        and isinstance(node.value, ast.Name)
        and node.value.id == "drone_rl"
    }
    assert used <= set(drone_rl.__all__)


def test_every_public_name_is_in_the_reference():
    text = "\n".join(page.read_text() for page in (ROOT / "docs/reference/api").glob("*.md"))
    entries = re.findall(r"^::: (\S+)$", text, re.MULTILINE)
    homes = [f"{home}.{name}" for name, home in drone_rl._HOMES.items()]
    assert sorted(entries) == sorted(homes)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_files_that_it_links_are_there(page):
    for path, heading in re.findall(r"\]\(([^)#:]+)(?:#([^)]+))?\)", page.read_text()):
        target = page.parent / path
        assert target.exists() or path.endswith(".schema.json"), path  # made with the site
        if heading and "." not in heading:  # those with a dot are made of docstrings
            titles = re.findall(r"^#+ (.+)$", target.read_text(), re.MULTILINE)
            slugs = {re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-") for title in titles}
            assert heading in slugs, f"{path}#{heading}"


@pytest.mark.parametrize("name", ["design", "where"])
def test_modules_and_folders_that_it_names_exist(name):
    text = (ROOT / "docs" / f"{name}.md").read_text()
    named = re.findall(r"`((?:drone_rl|benchmarks|conf)/[\w./]*)`", text)
    assert len(named) > 10
    assert [path for path in named if not (ROOT / path).exists()] == []
