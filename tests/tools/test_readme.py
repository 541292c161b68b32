"""Generated blocks of README.md and docs/ are current, and tables show the right figures."""

import json
import re

import pytest

from benchmarks.benchmark import Benchmark
from benchmarks.ledger import Ledger, Origin, digest_code, make_origin
from benchmarks.registry import BENCHMARKS
from tools.readme import __main__ as readme
from tools.readme import rows
from tools.readme.__main__ import ROOT, keep, main, make_blocks, make_files, replace_blocks
from tools.readme.notebook import make_notebook
from tools.readme.tables import (
    UNKNOWN,
    Row,
    fill,
    list_origins,
    make_table,
)

TABLES = (
    *(rows.MAIN, rows.ADVERSARIAL, rows.VERIFICATION, rows.FLIGHT, rows.LIBRARIES, rows.TASKS),
    *(rows.INPUTS, rows.WORLDS),
)


@pytest.fixture(scope="module")
def files():
    return make_files(ROOT)


def test_generated_files_are_current(files):
    for path, content in files.items():
        assert content == path.read_text(), f"{path}: run make readme"


def test_every_generated_block_is_on_a_page(files):
    text = "".join(files.values())
    assert set(re.findall(r"<!-- made: (\w+) -->", text)) == set(make_blocks(ROOT))


def test_only_blocks_are_replaced():
    text = "a\n<!-- made: x -->\nold\n<!-- /made -->\nb\n<!-- made: y -->\n<!-- /made -->\n"
    new = "a\n<!-- made: x -->\n1\n2\n<!-- /made -->\nb\n<!-- made: y -->\n3\n<!-- /made -->\n"
    assert replace_blocks(text, {"x": "1\n2\n", "y": "3"}) == new


def test_rows_name_benchmarks():
    named = {row.bench for table in TABLES for row in table}
    assert set(BENCHMARKS) - named == {"scaling", "revisions"}  # a chart, and for contributors
    assert named <= set(BENCHMARKS)
    assert {row.bench for row in rows.HEADLINES} <= named and len(rows.HEADLINES) <= 3


@pytest.mark.parametrize(
    "row", [r for t in (*TABLES, rows.HEADLINES) for r in t], ids=lambda r: r.label
)
def test_a_row_shows_kept_figures(row):
    ledger = Ledger(ROOT / "docs" / "results.json")
    table = make_table([row], ledger.figures)
    is_new = row.bench not in ledger.origins  # it has not run on a quiet machine yet
    assert UNKNOWN not in table or is_new or row.bench == "airsim"  # newest figures: not kept yet


@pytest.mark.parametrize(
    ("template", "text"),
    [
        ("{small:%}", "0.079%"),
        ("{seconds.median:.1f} of {seconds:.0f}", "5.2 of 4, 5, 6"),
        ("{small:two digits}", "0.00079"),
        ("{count:,}; {is_same}", "12,345; yes"),
    ],
)
def test_cells(template, text):
    figures = {"share": 0.9525, "small": 0.00079, "seconds": [4.0, 5.25, 6.0], "count": 12345}
    assert fill(template, {**figures, "is_same": True, "ratios": {"a": 18.54, "b": 25.8}}) == text


def test_a_missing_figure_is_marked_as_unmeasured():
    table = make_table([Row("moon", "tide", "{tide_m:.1f} m", "3 m")], {})
    assert table.splitlines()[2:] == [f"| tide | {UNKNOWN} | 3 m | `moon` |"]


def add(ledger, name, code, **figures):
    origin = Origin(
        revision="0123456789abcdef-dirty", date="2026-11-21", machine="m", code=code, settings={},
        keys=(),
    )  # fmt: skip
    ledger.add(name, figures, origin)


def test_outdated_figures_are_reported(tmp_path, monkeypatch, capsys):
    (tmp_path / "drone_rl").mkdir()
    (tmp_path / "drone_rl" / "sim.py").write_text("1")
    (tmp_path / "docs").mkdir()
    ledger = Ledger(tmp_path / "docs" / "results.json")
    add(ledger, "new", digest_code(["sim"], tmp_path), a=1)
    add(ledger, "old", "abc", b=1)
    names = ("new", "old", "never")
    benchmarks = {name: Benchmark(dict, "tests", ("sim",)) for name in names}
    monkeypatch.setattr(readme, "BENCHMARKS", benchmarks)
    monkeypatch.setattr(readme, "ROOT", tmp_path)
    assert main(["stale"]) == 0
    new, old, never = capsys.readouterr().out.splitlines()
    assert new == "new: measured 2026-11-21 at 0123456789ab, current"
    assert "OUTDATED" in old and never == "never: never measured"
    assert list_origins(ledger, ["new", "never"]).splitlines()[2:] == [
        f"| `never` | {UNKNOWN} |  |  |",
        "| `new` | 2026-11-21 | `0123456789ab-dirty` | m |",
    ]


def test_newer_figures_and_plots_replace_only_those_of_their_benchmarks(tmp_path):
    measured, docs = tmp_path / "bench", tmp_path / "docs"
    for folder in (measured, docs):
        folder.mkdir()
        for plot in ("peers.png", "scaling.png"):
            (folder / plot).write_text(folder.name)
    (measured / "scaling.png").unlink()
    kept = Ledger(docs / "results.json")
    add(kept, "new", "abc", new_s=1.0)
    add(kept, "old", "abc", old_s=1.0)
    Ledger(measured / "results.json").add("old", {"old_s": 2.0}, make_origin("def", {}))
    assert keep(measured, docs) == ["old", "peers.png"]
    kept = Ledger(docs / "results.json")
    assert kept.figures == {"new_s": 1.0, "old_s": 2.0} and kept.origins["old"].code == "def"
    assert (docs / "peers.png").read_text() == "bench"
    assert (docs / "scaling.png").read_text() == "docs"


def test_an_unknown_argument_is_an_error():
    assert main(["fresh"]) == 2


def test_a_notebook_has_a_code_cell_for_each_python_block():
    code = "```python\nx = 1\n\ny = 2\n```\n"
    page = f'# Title\n\nWords.\n\n{code}\n```sh\nls\n```\n\n```python title="a.py"\nx = 1\n```\n'
    cells = json.loads(make_notebook(page))["cells"]
    assert [(cell["cell_type"], "".join(cell["source"])) for cell in cells] == [
        ("markdown", "# Title\n\nWords."),
        ("code", "x = 1\n\ny = 2"),
        ("markdown", '```sh\nls\n```\n\n```python title="a.py"\nx = 1\n```'),
    ]
