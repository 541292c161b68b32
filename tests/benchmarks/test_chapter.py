"""Elements of the chapter that a command or test shows, and trainings of its algorithm."""

import re
from pathlib import Path

from drone_rl.cli.commands import COMMANDS

ROOT = Path(__file__).parents[2]


def test_every_element_of_the_chapter_is_shown_by_a_command_or_test():
    """20 equations, 4 algorithms, 4 tables, 3 listings and 15 figures."""
    page = (ROOT / "docs" / "chapter.md").read_text()
    element = r"^\| (?:Eq\.|Algorithm|Table|Listing|Fig\.) \d+ \|(.*)\|$"
    rows = re.findall(element, page, re.MULTILINE)
    assert len(rows) == 46
    for row in rows:
        commands = re.findall(r"`drone-rl ([\w-]+)", row)
        tests = re.findall(r"`(tests/\S+\.py)`", row)
        assert commands or tests, row
        assert {*commands} <= {*COMMANDS} and all((ROOT / path).is_file() for path in tests), row
