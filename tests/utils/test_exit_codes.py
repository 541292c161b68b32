"""Exit codes, as the pages document them."""

import re
from pathlib import Path

from drone_rl.utils import exit_codes

DOCS = Path(__file__).parents[2] / "docs"
CODES = {name: value for name, value in vars(exit_codes).items() if name.isupper()}


def test_each_exit_code_has_one_meaning():
    assert len({*CODES.values()}) == len(CODES) and 0 not in CODES.values()


def test_the_page_about_verdicts_documents_their_exit_codes():
    names = (
        "POOR",
        "ONE_SIDED",
        "NO_KIND",
        "NOT_CERTAIN",
        "PROOF_MISSING",
        "NOT_COVERED",
        "TRIVIAL",
    )
    rows = re.findall(r"^\| [a-z, -]+ \| (\d+) \|", (DOCS / "verdicts.md").read_text(), re.M)
    assert sorted(map(int, rows)) == sorted([0, *(CODES[name] for name in names)])


def test_the_page_about_verification_documents_its_exit_codes():
    text = (DOCS / "verification.md").read_text()
    assert f"otherwise {CODES['NOT_PROVED']}." in text
    assert f"else {CODES['CERTIFICATE_REFUSED']}" in text
