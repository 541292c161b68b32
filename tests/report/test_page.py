import csv
import html
import json
import re

import pytest

from drone_rl.report import write_report
from drone_rl.utils.errors import InputError
from tests.report.conftest import NASTY


@pytest.fixture(scope="session")
def report(explanations, tmp_path_factory):
    return write_report(explanations, tmp_path_factory.mktemp("report"))


def test_one_file_that_asks_for_nothing(report):
    page = report.read_text()
    assert not re.findall(r"""(?:src|href)\s*=\s*["'](?!data:|#)""", page)
    assert "http://" not in page and "https://" not in page
    assert report.stat().st_size < 10 * 2**20


def test_names_and_paths_are_escaped(report):
    page = report.read_text()
    assert NASTY not in page
    assert html.escape(NASTY, quote=False)[:20] in page.replace("&#34;", '"')
    assert page.count("</script>") == 1


def test_summary_and_verdict_come_first(report):
    page = report.read_text()
    order = ["summary", "tsne", "flaws", "class-models", "attribution", "truth", "response"]
    found = [page.index(f'<section id="{name}">') for name in [*order, "asymmetry", "provenance"]]
    assert found == sorted(found)
    assert page.index("of the cubes") < found[1]


def test_figures_are_saved_with_their_numbers(report):
    figures = report.parent / "figures"
    for name in ("tsne_features", "class_model", "sequence", "truth", "response", "asymmetry"):
        assert (figures / f"1_second_{name}.png").read_bytes().startswith(b"\x89PNG")
    with open(figures / "1_second_response.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 41 * 31
    total = sum(float(rows[0][f"p_{a}"]) for a in ("forward", "left", "right"))
    assert total == pytest.approx(1, abs=1e-3)
    assert "trusted" in json.loads((figures / "1_second_truth.json").read_text())
    assert (figures / "1_second_episode.mp4").stat().st_size > 0


def test_a_damaged_explanation_is_refused(tmp_path):
    (tmp_path / "explanation.json").write_text("{")
    with pytest.raises(InputError, match="can't be read"):
        write_report([tmp_path], tmp_path)
    assert not (tmp_path / "report.html").exists()
