"""The report as a file: reading explanations, what the page holds, and that it runs nothing."""

import base64
import hashlib
import html
import json
import os
import re
import shutil
from importlib import resources

import numpy as np
import pytest

from drone_rl.explanations.report import page, write_report
from drone_rl.explanations.report.explanation import FORMAT, FORMAT_VERSION, Explanation
from drone_rl.explanations.report.page import PARTS, find_explanations
from drone_rl.utils.errors import InputError
from drone_rl.utils.intervals import proportion
from tests.evidence import SAVED_SHIFTS, SHIFTS
from tests.explanations.quick import ALL_SECTIONS, quick_figures
from tests.explanations.report.conftest import NASTY


@pytest.fixture
def changed(explanations, tmp_path):
    """Copies an explanation with entries added or (None) taken away."""

    def build(arrays=None, **entries):
        folder = tmp_path / "changed"
        shutil.copytree(explanations[1], folder)
        numbers = json.loads((folder / "explanation.json").read_text()) | entries
        kept = {key: value for key, value in numbers.items() if value is not None}
        (folder / "explanation.json").write_text(json.dumps(kept))
        if arrays:
            with np.load(folder / "arrays.npz") as before:
                np.savez_compressed(folder / "arrays.npz", **before, **arrays)
        return folder

    return build


@pytest.fixture
def folder(tmp_path):
    """Writes a minimal explanation."""

    def write(numbers=None, arrays=None):
        header = {"format": FORMAT, "format_version": FORMAT_VERSION, "name": "x"}
        if not isinstance(numbers, str):
            numbers = json.dumps({**header, **(numbers or {})})
        (tmp_path / "explanation.json").write_text(numbers)
        for name in ("arrays", "dataset"):
            np.savez_compressed(tmp_path / f"{name}.npz", **(arrays or {"a": np.arange(3)}))
        return tmp_path

    return write


def test_an_explanation_is_read(folder):
    loaded = Explanation.load(folder({"share": float("nan")}))
    assert loaded.name == "x"
    assert loaded.arrays["a"].tolist() == loaded.data["a"].tolist() == [0, 1, 2]


@pytest.mark.parametrize(
    ("numbers", "arrays"),
    [
        ("{", None),
        ("[1]", None),
        ("[" * 50_000, None),
        ({"format_version": 1}, None),
        (None, {"a": np.array([{}], dtype=object)}),
    ],
)
def test_a_damaged_explanation_is_refused(folder, tmp_path, numbers, arrays):
    with pytest.raises(InputError, match="can't be read"):
        write_report([folder(numbers, arrays)], tmp_path)
    assert not (tmp_path / "report.html").exists()


def test_an_incomplete_explanation_is_refused(changed, tmp_path):
    incomplete = changed(truth={"methods": 5})
    with pytest.raises(InputError, match="lack entries that a report needs"):
        page.report([incomplete], tmp_path / "report")


def explained(root, *names):
    for name in names:
        (root / name).mkdir(parents=True)
        (root / name / "explanation.json").write_text("{}")
    return root


def test_explanations_are_found_in_folders_and_in_the_newest_run(tmp_path):
    run = explained(tmp_path / "run", "1_b", "0_a")
    assert find_explanations([str(run)]) == [run / "0_a", run / "1_b"]
    assert find_explanations([str(run / "1_b"), str(run / "0_a")]) == [run / "1_b", run / "0_a"]
    for number, name in enumerate(("b", "a")):
        explained(tmp_path / "explain" / "runs" / name, "0_x")
        os.utime(tmp_path / "explain" / "runs" / name, (number, number))
    assert find_explanations(("latest",), tmp_path) == [tmp_path / "explain/runs/a/0_x"]
    for which in (["latest"], [str(tmp_path / "explain")]):
        with pytest.raises(InputError, match="explain"):
            find_explanations(which, tmp_path / "run")


def test_each_section_has_a_part_and_each_part_a_template():
    assert PARTS.keys() - {"left_out", "asymmetry"} == ALL_SECTIONS.keys()
    templates = resources.files("drone_rl.explanations.report") / "templates" / "sections"
    assert {f"{name}.html" for name in PARTS} == {t.name for t in templates.iterdir()}


def test_the_page_loads_nothing(report):
    text = report.read_text()
    assert not re.findall(r"""(?:src|href)\s*=\s*["'](?!data:|#)""", text)
    assert "http://" not in text and "https://" not in text
    assert report.stat().st_size < 10 * 2**20


def test_names_and_paths_are_escaped(report):
    text = report.read_text()
    assert NASTY not in text
    assert html.escape(NASTY, quote=False)[:20] in text.replace("&#34;", '"')
    assert text.count("</script>") == text.count("<script") == 3  # the program, data of two maps


def test_the_content_policy_allows_only_the_page_s_own_style_and_script(report):
    text = report.read_text()
    policy = html.unescape(re.findall(r'<meta http-equiv="[^"]+" content="([^"]+)">', text)[0])
    assert "unsafe" not in policy
    for source in ("default-src", "base-uri", "form-action", "object-src"):
        assert f"{source} 'none'" in policy
    for element in ("style", "script"):
        (content,) = re.findall(f"<{element}>(.*?)</{element}>", text, re.S)
        digest = base64.b64encode(hashlib.sha256(content.encode()).digest()).decode()
        assert f"{element}-src 'sha256-{digest}'" in policy
    assert not re.findall(r"\sstyle=|\son\w+=", text)


def test_every_part_is_on_the_page_in_order_with_a_link(report):
    text = report.read_text()
    order = [name for name in PARTS if name not in ("left_out", "shifts")]
    ids = ["summary", *order, "methods", "provenance"]
    assert re.findall(r'<section id="([^"]+)">', text) == ids
    nav = text[text.index("<nav") : text.index("</nav>")]
    assert re.findall(r'<a href="#([^"]+)">', nav) == ids[1:]
    assert set(re.findall(r'<a href="#([^"]+)">', text)) <= set(re.findall(r'id="([^"]+)"', text))
    summary = text[text.index('<section id="summary">') :].split("</section>")[0]
    assert re.findall(r'<dt><a href="#(\w+)">', summary)[:5] == [
        "evaluation", "evaluation", "evaluation", "places", "truth"
    ]  # fmt: skip
    assert "a/explanation.json" in text and "b/explanation.json" in text


def test_figures_are_saved(report):
    figures = report.parent / "figures"
    charts = ("truth_1", "response_1", "places", "effects")
    for name in (*charts, "tsne_features", "class_model_1", "untrusted_1", "asymmetry_1"):
        assert (figures / f"1_second_{name}.png").read_bytes().startswith(b"\x89PNG")
    for name in charts:
        assert (figures / f"1_second_{name}.svg").read_text().startswith("<?xml")
    assert (figures / "1_second_episode.mp4").stat().st_size > 0


def with_intervals(value):
    """Return evidence with the exact interval of each rate."""
    if isinstance(value, dict):
        items = {key: with_intervals(item) for key, item in value.items()}
        is_rate = "trials" in items
        return items | (dict(proportion(items["successes"], items["trials"])) if is_rate else {})
    return [*map(with_intervals, value)] if isinstance(value, list) else value


def test_a_robustness_evaluation_is_shown(changed, tmp_path):
    arrays = {f"shifts_{name}": np.zeros((6, 5, 16, 3), np.uint8) for name in SHIFTS["axes"]}
    with quick_figures():
        text = write_report(
            [changed(arrays, shifts=with_intervals(SAVED_SHIFTS))], tmp_path
        ).read_text()
    part = text[text.index('<section id="shifts">') :].split("</section>")[0]
    assert "the sun at 21.1 to 60 degrees" in part and part.count("data:image/svg") == 3 + 1
    assert "not measured again here" in part and "<td>elevation of the sun</td>" in part


def test_missing_sections_are_left_out_and_unknown_entries_are_listed(changed, tmp_path):
    kept = ("dataset", "asymmetry")
    missing = {entry: None for part in PARTS.values() for entry in part.needs if entry not in kept}
    key = "../../<b>tides"
    explanation = changed(**{**missing, key: {"height": 3.25}})
    text = write_report([explanation], tmp_path / "x" / "y").read_text()
    shown = ["summary", *kept, "others", "methods", "provenance"]
    assert re.findall(r'<section id="([^"]+)">', text) == shown
    assert "<b>tides" not in text
    assert html.escape(key) in text and "&#34;height&#34;: 3.25" in text
    written = {path.name for path in (tmp_path / "x" / "y").rglob("*") if path.is_file()}
    stems = {name.rpartition(".")[0] for name in written}
    assert stems == {"report", *(f"0_second_asymmetry_{i}" for i in (1, 2, 3))}


def test_the_verdict_is_said_by_its_figures_and_not_by_the_file(changed, tmp_path):
    verdict = json.loads((changed() / "explanation.json").read_text())["verdict"]
    shutil.rmtree(tmp_path / "changed")
    explanation = changed(verdict={**verdict, "sentence": "It never fails anywhere."})
    with quick_figures():
        text = page.report([explanation], tmp_path / "report").read_text()
    assert "It never fails anywhere." not in text
