import base64
import csv
import hashlib
import html
import json
import re
import shutil

import jinja2
import numpy as np
import pytest

from drone_rl.explanations.report import write_report
from drone_rl.explanations.report.page import PARTS
from drone_rl.utils.errors import InputError
from drone_rl.utils.intervals import proportion
from tests.evidence import SHIFTS
from tests.explanations.quick import quick_figures
from tests.explanations.report.conftest import NASTY


@pytest.fixture
def changed(explanations, tmp_path):
    """Copies an explanation with entries added or (None) taken away."""

    def build(**entries):
        folder = tmp_path / "changed"
        shutil.copytree(explanations[1], folder)
        numbers = json.loads((folder / "explanation.json").read_text()) | entries
        kept = {key: value for key, value in numbers.items() if value is not None}
        (folder / "explanation.json").write_text(json.dumps(kept))
        return folder

    return build


def test_one_file_that_asks_for_nothing(report):
    page = report.read_text()
    assert not re.findall(r"""(?:src|href)\s*=\s*["'](?!data:|#)""", page)
    assert "http://" not in page and "https://" not in page
    assert report.stat().st_size < 10 * 2**20


def test_names_and_paths_are_escaped(report):
    page = report.read_text()
    assert NASTY not in page
    assert html.escape(NASTY, quote=False)[:20] in page.replace("&#34;", '"')
    assert page.count("</script>") == page.count("<script") == 3  # the program, data of two maps


def test_the_policy_allows_the_pages_own_style_and_script_alone(report):
    page = report.read_text()
    policy = html.unescape(re.findall(r'<meta http-equiv="[^"]+" content="([^"]+)">', page)[0])
    assert "unsafe" not in policy
    for source in ("default-src", "base-uri", "form-action", "object-src"):
        assert f"{source} 'none'" in policy
    for element in ("style", "script"):
        (text,) = re.findall(f"<{element}>(.*?)</{element}>", page, re.S)
        digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
        assert f"{element}-src 'sha256-{digest}'" in policy
    assert not re.findall(r"\sstyle=|\son\w+=", page)


def test_every_part_is_there_in_order_with_a_link_to_it(report):
    page = report.read_text()
    order = [name for name in (*PARTS, "provenance") if name not in ("left_out", "shifts")]
    ids = ["summary", *order[:-1], "methods", "provenance"]
    assert re.findall(r'<section id="([^"]+)">', page) == ids
    nav = page[page.index("<nav") : page.index("</nav>")]
    assert re.findall(r'<a href="#([^"]+)">', nav) == ids[1:]
    assert set(re.findall(r'<a href="#([^"]+)">', page)) <= set(re.findall(r'id="([^"]+)"', page))
    assert page.index("of the cubes") < page.index('<section id="dataset">')


def test_the_summary_answers_each_question_with_a_link(report):
    page = report.read_text()
    part = page[page.index('<section id="summary">') :].split("</section>")[0]
    labels = ["Verdict", "Success rate", "Robustness", "Verification", "Exact map", "Heat maps"]
    found = re.findall(r"<dt>(?:<a href=\"#(\w+)\">)?([^<]+)", part)
    assert [label for _, label in found] == [*labels, "Not shown"] * 2
    assert [section for section, _ in found][:7] == [
        "evaluation", "evaluation", "", "evaluation", "places", "truth", ""
    ]  # fmt: skip
    assert "(95% CI" in part and "run drone-rl shifts" in part and "drone-rl prove" in part


def test_figures_are_saved_with_their_numbers(report):
    figures = report.parent / "figures"
    for name in (
        "tsne_features",
        "class_model_1",
        "untrusted_1",
        "truth_1",
        "response_1",
        "places",
        "asymmetry_1",
    ):
        assert (figures / f"1_second_{name}.png").read_bytes().startswith(b"\x89PNG")
    for name in ("truth_1", "response_1", "places", "curves_1", "heat"):
        assert (figures / f"1_second_{name}.svg").read_text().startswith("<?xml")
    with open(figures / "1_second_response.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 9 * 4
    total = sum(float(rows[0][f"p_{a}"]) for a in ("forward", "left", "right"))
    assert total == pytest.approx(1, abs=1e-3)
    assert "trusted" in json.loads((figures / "1_second_truth.json").read_text())
    assert (figures / "1_second_episode.mp4").stat().st_size > 0


def flown_shifts():
    """Flights under other conditions with the exact intervals that a reader insists on."""
    shifts = json.loads(json.dumps(SHIFTS))
    waiting = [shifts]
    while waiting:
        item = waiting.pop()
        if isinstance(item, dict) and "successes" in item:
            item |= proportion(item["successes"], item["trials"])
        waiting += item.values() if isinstance(item, dict) else item
        waiting = [value for value in waiting if isinstance(value, dict | list)]
    return shifts


def test_the_page_says_which_file_it_repeats(report):
    page = report.read_text()
    for folder in "ab":
        assert f"This page repeats what {folder}/explanation.json says (written 20" in page


def test_conditions_are_shown_where_they_were_flown(explanations, tmp_path):
    folder = tmp_path / "flown"
    shutil.copytree(explanations[1], folder)
    numbers = json.loads((folder / "explanation.json").read_text())
    numbers |= {"shifts": flown_shifts()}
    (folder / "explanation.json").write_text(json.dumps(numbers))
    arrays = {f"shifts_{name}": np.zeros((6, 5, 16, 3), np.uint8) for name in SHIFTS["axes"]}
    with np.load(folder / "arrays.npz") as kept:
        np.savez_compressed(folder / "arrays.npz", **{**kept, **arrays})
    with quick_figures():
        page = write_report([folder], tmp_path).read_text()
    part = page[page.index('<section id="shifts">') :].split("</section>")[0]
    assert "the sun at 21.1 to 60 degrees" in part and part.count("data:image/svg") == 3 + 1
    assert part.count("data:image/png") == 3 + 3 + 2  # as trained, and each strength
    assert "not measured again here" in part and "<td>elevation of the sun</td>" in part
    assert "nothing here tests other colors or sizes" in page


def test_what_is_missing_is_left_out(changed, tmp_path):
    maps = ("response", "places")
    gone = ("tsne", "truth", "attribution", *maps, "class_model", "contradictions")
    with quick_figures():
        page = write_report([changed(**dict.fromkeys(gone))], tmp_path).read_text()
    shown = ["evaluation", "dataset", "asymmetry", "others", "methods", "provenance"]
    assert re.findall(r'<section id="([^"]+)">', page) == ["summary", *shown]
    assert "<summary>loops</summary>" in page  # half of a part that needs contradictions, too


def test_what_no_part_shows_is_laid_out_plainly_and_names_no_file(changed, tmp_path):
    maps = ("response", "places")
    parts = ("verdict", "tsne", "truth", "attribution", *maps, "class_model", "loops")
    key = "../../<b>tides"
    folder = changed(**dict.fromkeys(parts), contradictions=None, **{key: {"height": 3.25}})
    page = write_report([folder], tmp_path / "x" / "y").read_text()
    assert "<b>tides" not in page
    assert html.escape(key) in page and "&#34;height&#34;: 3.25" in page
    written = {path.name for path in (tmp_path / "x" / "y").rglob("*") if path.is_file()}
    stems = {name.rpartition(".")[0] for name in written}
    asymmetry = {"0_second_asymmetry", *(f"0_second_asymmetry_{i}" for i in (1, 2, 3))}
    assert stems == {"report", "0_second_dataset", *asymmetry}


def test_a_damaged_explanation_is_refused(tmp_path):
    (tmp_path / "explanation.json").write_text("{")
    with pytest.raises(InputError, match="can't be read"):
        write_report([tmp_path], tmp_path)
    assert not (tmp_path / "report.html").exists()


@pytest.mark.parametrize(
    ("key", "value"),
    [("places", {"window": 0}), ("truth", {"methods": 5}), ("response", {"rows": [0]})],
)
def test_a_wrong_number_is_refused_before_any_image_is_made(changed, tmp_path, key, value):
    with pytest.raises((InputError, LookupError, TypeError)):
        write_report([changed(**{key: value})], tmp_path / "report")
    assert not list(tmp_path.glob("report/figures/*"))


def test_slow_parts_are_rendered_last(changed, tmp_path):
    folder = changed()
    numbers = json.loads((folder / "explanation.json").read_text())
    numbers["truth"]["curves"]["shares"] = None
    (folder / "explanation.json").write_text(json.dumps(numbers))
    with quick_figures(), pytest.raises(TypeError):
        write_report([folder], tmp_path / "report")
    assert not list(tmp_path.glob("report/figures/*.mp4"))


def test_a_missing_template_is_named_and_not_blamed_on_the_folder(
    explanations, tmp_path, monkeypatch
):
    def render(_):
        raise jinja2.TemplateNotFound("sections/mine.html")

    monkeypatch.setattr("drone_rl.explanations.report.page.render_page", render)
    with pytest.raises(jinja2.TemplateNotFound, match=r"sections/mine\.html"):
        write_report(explanations, tmp_path)
