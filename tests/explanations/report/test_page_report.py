"""Where explanations are found, and what becomes of those that lack something."""

import json
import os

import pytest

from drone_rl.explanations.report import page
from drone_rl.explanations.report.page import find_explanations, report
from drone_rl.utils.errors import InputError
from tests.explanations.quick import quick_figures


def explained(folder, *names):
    for name in names:
        (folder / name).mkdir(parents=True)
        (folder / name / "explanation.json").write_text("{}")
    return folder


def test_a_folder_of_several_means_all_of_them(tmp_path):
    run = explained(tmp_path / "run", "1_b", "0_a")
    assert find_explanations([str(run)]) == [run / "0_a", run / "1_b"]
    assert find_explanations([str(run / "1_b"), str(run / "0_a")]) == [run / "1_b", run / "0_a"]


def test_the_latest_is_the_newest(tmp_path):
    for number, name in enumerate(("b", "a")):
        explained(tmp_path / "explain" / "runs" / name, "0_x")
        os.utime(tmp_path / "explain" / "runs" / name, (number, number))
    assert find_explanations(("latest",), tmp_path) == [tmp_path / "explain/runs/a/0_x"]


def test_there_is_none(tmp_path):
    with pytest.raises(InputError, match=r"explanations=latest, but .* drone-rl explain first"):
        find_explanations(("latest",), tmp_path)
    with pytest.raises(InputError, match=r"holds no explanation\.json"):
        find_explanations([str(tmp_path)])


@pytest.mark.parametrize("error", [KeyError("verdict"), TypeError("x"), ZeroDivisionError()])
def test_what_lacks_something_is_a_mistake_of_the_file(monkeypatch, tmp_path, error):
    def fail(*_):
        raise error

    monkeypatch.setattr(page, "write_report", fail)
    with pytest.raises(InputError, match="lack entries that a report needs"):
        report([tmp_path], tmp_path)


def test_an_explanation_without_heat_of_any_method_is_refused(explanations, tmp_path):
    numbers = json.loads((explanations[0] / "explanation.json").read_text())
    numbers["truth"]["heat"] = {}
    for name in ("arrays.npz", "dataset.npz"):
        (tmp_path / name).write_bytes((explanations[0] / name).read_bytes())
    (tmp_path / "explanation.json").write_text(json.dumps(numbers))
    with pytest.raises(InputError, match="lack entries that a report needs"):
        report([tmp_path], tmp_path / "report")


def test_the_verdict_is_said_by_its_figures_and_not_by_the_file(explanations, tmp_path):
    numbers = json.loads((explanations[0] / "explanation.json").read_text())
    numbers["verdict"]["sentence"] = "It never fails anywhere."
    for name in ("arrays.npz", "dataset.npz"):
        (tmp_path / name).write_bytes((explanations[0] / name).read_bytes())
    (tmp_path / "explanation.json").write_text(json.dumps(numbers))
    with quick_figures():
        page = report([tmp_path], tmp_path / "report")
    assert "It never fails anywhere." not in page.read_text()
