"""The report as a file: reading explanations, what the page holds, and that it runs nothing."""

import base64
import hashlib
import html
import os
import re
from importlib import resources

import numpy as np
import pytest

from drone_rl.explanations.report import write_report
from drone_rl.explanations.report.page import PARTS, find_explanations, render_section
from drone_rl.explanations.results import Explanation
from drone_rl.utils.errors import InputError
from tests.explanations.example import CONTENT, PICTURED, changed_explanation
from tests.explanations.quick import ALL_SECTIONS, quick_figures
from tests.explanations.report.conftest import NASTY


def save(explanation, folder):
    """Write the files of an explanation."""
    folder.mkdir(exist_ok=True)
    explanation.save(folder)
    np.savez_compressed(folder / "dataset.npz", **explanation.data)
    return folder


def test_an_explanation_is_read_as_it_was_written(tmp_path):
    written = changed_explanation({"indecision": {"share": 0.5, "map": np.eye(2)}})
    read = Explanation.load(save(written, tmp_path / "x"))
    assert read.source == "x/explanation.json"
    np.testing.assert_equal(
        read.model_dump(exclude={"source"}), written.model_dump(exclude={"source"})
    )
    assert read.indecision["map"].tolist() == [[1, 0], [0, 1]]


@pytest.mark.parametrize(
    ("numbers", "arrays"),
    [
        ("{", None),
        (None, {"a": np.array([{}], dtype=object)}),
    ],
)
def test_a_damaged_explanation_is_refused(tmp_path, numbers, arrays):
    folder = save(changed_explanation(), tmp_path / "x")
    if numbers is not None:
        (folder / "explanation.json").write_text(numbers)
    if arrays is not None:
        np.savez_compressed(folder / "arrays.npz", **arrays)
    with pytest.raises(InputError, match="can't be read"):
        write_report([folder], tmp_path)
    assert not (tmp_path / "report.html").exists()


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
    assert PARTS.keys() - {"left_out"} == ALL_SECTIONS.keys()
    templates = resources.files("drone_rl.explanations.report") / "templates" / "sections"
    assert {f"{name}.html" for name in PARTS} == {t.name for t in templates.iterdir()}


def test_the_page_loads_nothing_and_escapes_names(report):
    text = report.read_text()
    assert not re.findall(r"""(?:src|href)\s*=\s*["'](?!data:|#)""", text)
    assert "http://" not in text and "https://" not in text
    assert report.stat().st_size < 10 * 2**20
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
    order = [
        name for name in PARTS if name not in ("left_out", "shifts", "importance", "scene_map")
    ]
    ids = ["summary", *order, "methods", "provenance"]
    assert re.findall(r'<section id="([^"]+)">', text) == ids
    nav = text[text.index("<nav") : text.index("</nav>")]
    assert re.findall(r'<a href="#([^"]+)">', nav) == ids[1:]
    assert set(re.findall(r'<a href="#([^"]+)">', text)) <= set(re.findall(r'id="([^"]+)"', text))
    assert "a/explanation.json" in text and "b/explanation.json" in text


def test_figures_are_saved(report):
    figures = report.parent / "figures"
    charts = ("truth_1", "response_1", "places", "effects")
    for name in (*charts, "tsne_features", "class_model_1", "untrusted_1", "asymmetry_1"):
        assert (figures / f"1_second_{name}.png").read_bytes().startswith(b"\x89PNG")
    for name in charts:
        assert (figures / f"1_second_{name}.svg").read_text().startswith("<?xml")
    assert (figures / "1_second_episode.mp4").stat().st_size > 0


def test_a_robustness_evaluation_is_shown(tmp_path):
    good = {"verdict.kind": "good", "shifts": PICTURED}
    with quick_figures():
        text = render_section("shifts", [changed_explanation(good)], tmp_path)
    assert "the sun at 21.1 to 60 degrees" in text and text.count("data:image/svg") == 3 + 1
    assert "Not measured again here" in text and "<td>elevation of the sun</td>" in text


def test_missing_sections_are_left_out(tmp_path):
    kept = ("dataset", "asymmetry")
    missing = {name: None for name in PARTS.keys() - {*kept, "left_out"}}
    changes = {**missing, "left_out": {}, "name": "second"}
    folder = save(Explanation.read({**CONTENT, **changes}), tmp_path / "y")
    text = write_report([folder], tmp_path / "x").read_text()
    shown = ["summary", *kept, "methods", "provenance"]
    assert re.findall(r'<section id="([^"]+)">', text) == shown
    written = {path.name for path in (tmp_path / "x").rglob("*") if path.is_file()}
    stems = {name.rpartition(".")[0] for name in written}
    assert stems == {"report", *(f"0_second_asymmetry_{i}" for i in (1, 2))}
