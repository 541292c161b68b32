"""Generated blocks of README.md and docs/ are current."""

import dataclasses
import json
import re

import pytest

from benchmarks.benchmark import Benchmark
from benchmarks.ledger import Ledger, Origin, digest_code, make_origin
from benchmarks.registry import BENCHMARKS
from tools.readme.__main__ import (
    PAGES,
    ROOT,
    keep,
    keep_plots,
    main,
    make_blocks,
    make_files,
)
from tools.readme.blocks import marked_blocks, replace_blocks
from tools.readme.flight_rows import FLIGHT
from tools.readme.headlines import HEADLINES, make_headlines
from tools.readme.library_rows import LIBRARIES
from tools.readme.packages import list_contracts, list_packages
from tools.readme.rows import MAIN, PROOF, TRUTH
from tools.readme.stale import report_ages
from tools.readme.tables import (
    UNKNOWN,
    Row,
    list_figures,
    list_origins,
    make_table,
    percent,
    seconds,
)


@pytest.fixture(scope="module")
def generated():
    return make_files(ROOT)


def test_generated_files_are_current(generated):
    for path, content in generated.items():
        assert content == (ROOT / path).read_text(), f"{path}: run make readme"


def test_every_generated_block_is_on_a_page():
    marked = set().union(*(marked_blocks((ROOT / path).read_text()) for path in PAGES))
    assert marked == set(make_blocks(ROOT))


@pytest.mark.parametrize("path", PAGES)
def test_named_files_and_folders_exist(path):
    text = (ROOT / path).read_text()
    named = set(re.findall(r"`((?:[a-z_]+/)+(?:[a-z_]+\.py)?)`", text))
    missing = {n for n in named if not any((ROOT / top / n).exists() for top in ("drone_rl", ""))}
    assert {n for n in missing if not n.startswith(("outputs/", "site/"))} == set()


def test_a_changed_figure_changes_the_pages(tmp_path):
    for name in (*PAGES, "pyproject.toml", "docs/results.json", "docs/tutorials/notebook.md"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text((ROOT / name).read_text())
    for name in ("drone_rl", "conf", "examples"):
        (tmp_path / name).symlink_to(ROOT / name)
    path = tmp_path / "docs" / "results.json"
    changed = {"sweep_speedup": 1.234, "seeds_solved": 4, "success_lower95": [0.999, 0.876]}
    path.write_text(json.dumps(json.loads(path.read_text()) | changed))
    pages = make_files(tmp_path)
    assert "| 1.23 times | 1.6 times | `sweeps` |" in pages["docs/results.md"]
    assert "| `sweep_speedup` | 1.234 | `sweeps` |" in pages["docs/results.md"]
    assert "| 87.6% | `drone-rl bench solve` |" in pages["README.md"]
    assert "| 87.6% | 95% | `solve` |" in pages["docs/results.md"]


def test_only_blocks_are_replaced():
    text = "a\n<!-- made: x -->\nold\n<!-- /made -->\nb\n<!-- made: y -->\n<!-- /made -->\n"
    new = "a\n<!-- made: x -->\n1\n2\n<!-- /made -->\nb\n<!-- made: y -->\n3\n<!-- /made -->\n"
    assert replace_blocks(text, {"x": "1\n2\n", "y": "3"}) == new
    assert replace_blocks(new, {"x": "1\n2", "y": "3"}) == new


@pytest.mark.parametrize("blocks", [{}, {"z": ""}])
def test_an_unknown_block_raises(blocks):
    with pytest.raises(ValueError, match=r"blocks \['x'\] are unknown"):
        replace_blocks("<!-- made: x -->\n<!-- /made -->", blocks)


def test_a_missing_figure_is_marked_as_unmeasured():
    rows = (Row("moon", "tide", lambda f: f"{f['tide_m']:.1f} m", "3 m"),)
    assert make_table(rows, {"tide_m": 2.96}).splitlines()[2:] == [
        "| tide | 3.0 m | 3 m | `moon` |"
    ]
    assert f"| tide | {UNKNOWN} | 3 m | `moon` |" in make_table(rows, {})


def test_every_benchmark_with_figures_has_a_row():
    rows = (*MAIN, *FLIGHT, *TRUTH, *PROOF, *LIBRARIES)
    named = {row.bench for row in rows}
    assert named <= set(BENCHMARKS)
    assert set(BENCHMARKS) - named == {
        "scaling",
        "revisions",
    }  # a chart, and a comparison for contributors
    assert {row.bench for row in HEADLINES} <= named and len(HEADLINES) <= 8


def test_headline_cells():
    figures = {
        "time_to_solve_s": [4.0, 5.25, 6.0],
        "success_lower95": [0.996, 0.991],
        "peers": {
            "reinforce": {"seconds": [6.0, 5.0]},
            "a2c": {"seconds": [8.0]},
            "sb3_ppo": {"seconds": [9.0, 9.4]},
            "sb3_a2c": {"seconds": [13.0]},
            "torchrl": {"seconds": [15.0]},
        },
        "solve_over_best_peer": 0.598,
        "render_over_warp": {"25x64": 18.54, "64x64": 25.8},
        "gamed_verdicts": 1,
        "gamed_total": 34,
    }
    cells = [line.split(" | ")[1] for line in make_headlines(HEADLINES, figures).splitlines()[2:]]
    assert cells == [
        "5.2",
        "99.1%",
        "0.60 (5.5 s against 9.2 s)",
        "18.5 times",
        "1 of 34",
        *[UNKNOWN] * 2,
    ]


def test_table_cells():
    figures = {
        "time_to_solve_s": [30.0, 20.4, 25.0, 21.0, 40.6],
        "success_lower95": [0.996, 0.991],
        "peak_memory_mib": 1023.6,
        "verdicts_right": 44,
        "verdicts_certain": 45,
        "verdicts_total": 55,
        "planted_maps_found": 26 / 27,
        "planted_maps_total": 27,
        "launcher_overhead": 0.0794,
        "proof_two_s": 4.2,
        "proof_two_scaled_s": 3.0,
        "onnx_max_difference": 2.56e-6,
        "onnx_frames": 40_000,
        "onnx_actions_differ": 3,
        "gamed_verdicts": 1,
        "gamed_total": 34,
        "fragile_honest": 2,
        "fragile_honest_total": 14,
        "a11y_violations": 0,
        "a11y_pages": 40,
        "injections_run": 0,
        "injections_total": 1234,
        "domain_axes_right": 21,
        "domain_axes": 22,
    }
    text = "".join(make_table(rows, figures) for rows in (MAIN, FLIGHT, TRUTH, PROOF, LIBRARIES))
    assert "| 2.6 millionths on 40,000 images |" in text and "| 3 of 40,000 |" in text
    for cell in (
        "20 to 41, median 25",
        "99.1%",
        "1024 MiB",
        "44 of 45 certain, 55 in total",
        "7.9%",
    ):
        assert f"| {cell} |" in text
    assert "| 4.2, on a machine 1.4 times slower |" in text
    assert "| 26 of 27 |" in text
    for cell in ("1 of 34", "2 of 14", "0 of 1,234", "21 of 22"):
        assert f"| {cell} |" in text


@pytest.mark.parametrize(
    ("share", "text"),
    [(0.0, "0%"), (0.00079, "0.079%"), (0.009, "0.90%"), (0.9525, "95.2%"), (1.0, "100.0%")],
)
def test_percentages(share, text):
    assert percent(share) == text


@pytest.mark.parametrize(("value", "text"), [(0.0354, "0.035 s"), (1.29, "1.3 s"), (36.2, "36 s")])
def test_seconds_have_two_significant_digits(value, text):
    assert seconds(value) == text


def test_forbidden_imports_are_listed():
    contract = {
        "type": "forbidden",
        "name": "no water inside",
        "source_modules": ["drone_rl.top", "drone_rl.left"],
        "forbidden_modules": ["sea", "rain"],
    }
    listed = list_contracts([contract, {"type": "acyclic_siblings"}])
    assert listed == "- No water inside: top, left may not import sea, rain."


def test_packages_are_listed_with_their_subpackages(tmp_path):
    texts = {"base/__init__": "Low.", "top/__init__": "High.\n\nMore", "top/a/__init__": "In"}
    for name, text in texts.items():
        path = tmp_path / f"{name}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f'"""{text}"""\n')
    assert list_packages(tmp_path).splitlines()[2:] == [
        "| `base/` | Low |",
        "| `top/` | High |",
        "| `top/a/` | In |",
    ]


@pytest.fixture
def measured(tmp_path):
    """Return a ledger of three benchmarks and its folder; only "new" is current."""
    (tmp_path / "drone_rl").mkdir()
    (tmp_path / "drone_rl" / "sim.py").write_text("1")
    code = digest_code(["sim"], tmp_path)
    ledger = Ledger(tmp_path / "r.json")
    for name, of in (("new", code), ("old", "abc"), ("unknown", None)):
        origin = Origin(
            revision="0123456789abcdef", date="2026-11-21", machine="m", code=of, settings={},
            keys=(),
        )  # fmt: skip
        ledger.add(name, {f"{name}_s": 1.0}, origin)
    return ledger, tmp_path


def test_outdated_figures_are_reported(measured):
    ledger, root = measured
    names = ("new", "old", "unknown", "never")
    benchmarks = {name: Benchmark(lambda _: {}, "tests", ("sim",)) for name in names}
    since = "measured 2026-11-21 at 0123456789ab, "
    assert list(report_ages(benchmarks, ledger, root)) == [
        f"new: {since}current",
        f"old: {since}OUTDATED: sim changed since",
        f"unknown: {since}of unknown code",
        "never: never measured",
    ]


def test_every_figure_is_listed_with_its_origin(tmp_path):
    ledger = Ledger(tmp_path / "r.json")
    figures = {
        "tide_m": 2.0 / 3.0, "days": 3, "moons": [1.0, 0.5], "phases": {"new": 1, "full": 2},
        "names": ["a"] * 9, "lost": [], "by_day": {}, "name": "s" * 100, "text": "s" * 101,
    }  # fmt: skip
    origin = Origin(
        revision=None, date="2026-11-22", machine="2 cores", code=None, settings={}, keys=()
    )
    ledger.add("sea", figures, origin)
    assert [line.split(" | ")[:2] for line in list_figures(ledger).splitlines()[2:]] == [
        ["| `tide_m`", "0.6667"], ["| `days`", "3"], ["| `moons`", "1, 0.5"],
        ["| `phases`", "2 entries"], ["| `names`", "9 entries"], ["| `lost`", "none"],
        ["| `by_day`", "none"], ["| `name`", "s" * 100], ["| `text`", "101 characters"],
    ]  # fmt: skip
    assert "| `days` | 3 | `sea` | unknown | 2026-11-22 |" in list_figures(ledger)
    assert list_origins(ledger, ["moon", "sea"]).splitlines()[2:] == [
        "| `moon` | not measured yet |  |  |",
        "| `sea` | 2026-11-22 | unknown | 2 cores |",
    ]
    changed = dataclasses.replace(origin, revision="0123456789abcdef-dirty")
    ledger.add("sea", figures, changed)
    assert "| 2026-11-22 | `0123456789ab-dirty` |" in list_origins(ledger)


def test_newer_figures_replace_only_those_of_their_benchmarks(measured, tmp_path):
    kept, _ = measured
    newest = Ledger(tmp_path / "newest.json")
    newest.add("old", {"old_s": 2.0}, make_origin("def", {}))
    assert keep(newest.path, kept.path) == ["old"]
    assert Ledger(kept.path).figures == {"new_s": 1.0, "unknown_s": 1.0, "old_s": 2.0}
    assert Ledger(kept.path).origins["old"].code == "def"


def test_an_unknown_argument_is_an_error(capsys):
    assert main(["fresh"]) == 2
    assert "'fresh' is unknown" in capsys.readouterr().err


def test_plots_of_benchmarks_that_have_run_are_kept(tmp_path):
    measured, docs = tmp_path / "bench", tmp_path / "docs"
    for folder in (measured, docs):
        folder.mkdir()
    (measured / "peers.png").write_bytes(b"new")
    (docs / "peers.png").write_bytes(b"old")
    (docs / "scaling.png").write_bytes(b"old")
    assert keep_plots(measured, docs) == ["peers.png"]
    assert (docs / "peers.png").read_bytes() == b"new"
    assert (docs / "scaling.png").read_bytes() == b"old"


def test_the_number_of_simulated_policies_is_that_of_the_results():
    rows = [{"policy": name} for name in ("near", "near", "far")]
    text = make_table(TRUTH, {"false_certain_rate": 0.005, "certain": rows})
    assert "| 0.50%; 2 |" in text
